//! A plot as pixels.

use super::curves::{NamedPoint, Plot, Series};
use super::ticks::{rounded, ticks};
use crate::canvas::{Align, Canvas, Colour, FAINT, Font, INK, PALE, PAPER, Rect, text_width};

/// Told apart with every kind of colour vision: Okabe & Ito 2008, blue, vermilion, green, purple.
const CURVES: [Colour; 4] = [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167]];

/// Curves with at most so many points show each as a dot.
const DOTTED: usize = 60;

/// Where the axes lie and how values map to pixels.
struct Frame {
    width: usize,
    height: usize,
    axes: Rect,
    x: (f64, f64),
    y: (f64, f64),
    /// Wished number of ticks along x and y.
    counts: (usize, usize),
}

impl Frame {
    fn new(plot: &Plot, width: usize, height: usize) -> Self {
        let (width, height) = (width.max(320), height.max(200));
        let title = if plot.title.is_empty() { 0 } else { Font::Heading.height() + 8 };
        let top = 16 + title + Font::Body.height() + 10;
        let (left, right, below) = (64, 72, 2 * Font::Body.height() + 24);
        let axes = Rect { x: left, y: top, width: width - left - right, height: height - top - below };
        let counts = ((axes.width / 90).max(2), (axes.height / 56).max(2));
        let x = range(&plot.series, |p| p.0);
        let x = if x.0 < x.1 { x } else { (x.0, x.0 + 1.0) };
        let y = range(&plot.series, |p| p.1);
        Self { width, height, axes, x, y: rounded(y.0, y.1, counts.1), counts }
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let right = (x - self.x.0) / (self.x.1 - self.x.0) * self.axes.width as f64;
        let up = (y - self.y.0) / (self.y.1 - self.y.0) * self.axes.height as f64;
        (self.axes.x as f64 + right, (self.axes.y + self.axes.height) as f64 - up)
    }
}

/// Of the finite points; 0..1 when there are none.
fn range(series: &[Series], axis: fn(&(f64, f64)) -> f64) -> (f64, f64) {
    let finite = series.iter().flat_map(|s| &s.points).filter(|p| p.0.is_finite() && p.1.is_finite());
    let bounds =
        finite.map(axis).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if bounds.0 <= bounds.1 { bounds } else { (0.0, 1.0) }
}

impl Plot {
    /// Draws the plot, from back to front; sizes below 320×200 pixels are raised to that.
    pub fn draw(&self, width: usize, height: usize) -> Canvas {
        let frame = Frame::new(self, width, height);
        let mut canvas = Canvas::new(frame.width, frame.height, PAPER);
        axes(&frame, &mut canvas);
        labels(self, &frame, &mut canvas);
        for (series, &colour) in self.series.iter().zip(CURVES.iter().cycle()) {
            curve(series, &frame, colour, &mut canvas);
        }
        last_values(&self.series, &frame, &mut canvas);
        names(&self.named, &frame, &mut canvas);
        canvas
    }
}

fn axes(frame: &Frame, canvas: &mut Canvas) {
    let (xs, x_decimals) = ticks(frame.x.0, frame.x.1, frame.counts.0);
    let (ys, y_decimals) = ticks(frame.y.0, frame.y.1, frame.counts.1);
    let crisp = |v: f64| v.floor() + 0.5; // on pixel centres
    let (bottom, half) = (frame.axes.y + frame.axes.height, Font::Body.height() as i64 / 2);
    let (left, right) = (frame.axes.x as f64, (frame.axes.x + frame.axes.width) as f64);
    for y in ys {
        let at = crisp(frame.place((frame.x.0, y)).1);
        canvas.polyline(&[(left, at), (right, at)], 1.0, PALE);
        let place = (frame.axes.x as i64 - 8, at as i64 - half);
        canvas.text(place, &format!("{y:.y_decimals$}"), Font::Body.style(Align::Right, FAINT));
    }
    for x in xs {
        let at = crisp(frame.place((x, frame.y.0)).0);
        canvas.polyline(&[(at, bottom as f64 + 1.0), (at, bottom as f64 + 6.0)], 1.0, FAINT);
        let place = (at as i64, bottom as i64 + 8);
        canvas.text(place, &format!("{x:.x_decimals$}"), Font::Body.style(Align::Centre, FAINT));
    }
    let at = crisp(bottom as f64);
    canvas.polyline(&[(left, at), (right, at)], 1.0, FAINT);
}

fn labels(plot: &Plot, frame: &Frame, canvas: &mut Canvas) {
    let (axes, line) = (frame.axes, Font::Body.height() as i64);
    canvas.text((16, 14), &plot.title, Font::Heading.style(Align::Left, INK));
    let above = axes.y as i64 - line - 12;
    canvas.text((16, above), &plot.y_label, Font::Body.style(Align::Left, FAINT));
    let below = ((axes.x + axes.width / 2) as i64, (axes.y + axes.height) as i64 + 12 + line);
    canvas.text(below, &plot.x_label, Font::Body.style(Align::Centre, FAINT));
    let mut right = (axes.x + axes.width) as i64;
    let named: Vec<_> = plot.series.iter().zip(CURVES.iter().cycle()).collect();
    for (series, &colour) in named.into_iter().rev() {
        canvas.text((right, above), &series.name, Font::Body.style(Align::Right, INK));
        right -= text_width(Font::Body, &series.name) as i64 + 8;
        let y = (above + line / 2) as f64 + 0.5;
        canvas.polyline(&[(right as f64 - 20.0, y), (right as f64, y)], 3.0, colour);
        right -= 20 + 20;
    }
}

fn curve(series: &Series, frame: &Frame, colour: Colour, canvas: &mut Canvas) {
    let dotted = series.points.len() <= DOTTED;
    let width = if dotted { 2.0 } else { 1.3 };
    for piece in series.points.split(|p| !p.0.is_finite() || !p.1.is_finite()).filter(|p| !p.is_empty()) {
        let points: Vec<_> = piece.iter().map(|&p| frame.place(p)).collect();
        if dotted {
            points.iter().for_each(|&centre| canvas.polyline(&[centre], 6.0, colour));
        }
        canvas.polyline(&points, width, colour);
    }
}

/// Writes the last value of each curve at its right end, moved apart where they would overlap.
fn last_values(series: &[Series], frame: &Frame, canvas: &mut Canvas) {
    let line = Font::Body.height() as f64;
    let mut ends: Vec<_> = (series.iter().zip(CURVES.iter().cycle()))
        .filter_map(|(s, &colour)| {
            let last = s.points.iter().rev().find(|p| p.0.is_finite() && p.1.is_finite())?;
            Some((frame.place(*last).1 - line / 2.0, last.1, colour))
        })
        .collect();
    ends.sort_by(|a, b| a.0.total_cmp(&b.0));
    for k in 1..ends.len() {
        ends[k].0 = ends[k].0.max(ends[k - 1].0 + line);
    }
    let x = (frame.axes.x + frame.axes.width) as i64 + 10;
    for (y, value, colour) in ends {
        canvas.text((x, y as i64), &format!("{value:.2}"), Font::Strong.style(Align::Left, colour));
    }
}

/// Named points as dots, with their names on that side of them where nothing else is written.
fn names(named: &[NamedPoint], frame: &Frame, canvas: &mut Canvas) {
    let (high, axes) = (Font::Strong.height() as i64, frame.axes);
    let mut taken: Vec<[i64; 4]> = Vec::new();
    for NamedPoint { name, point } in named.iter().filter(|n| n.point.0.is_finite() && n.point.1.is_finite())
    {
        let centre = frame.place(*point);
        canvas.polyline(&[centre], 9.0, INK);
        let (x, y, wide) = (centre.0 as i64, centre.1 as i64, text_width(Font::Strong, name) as i64);
        // At the sides first, then a little higher or lower, then above and below.
        let sides = [-high / 2, -high - 2, 2].map(|dy| [(9, dy), (-9 - wide, dy)]);
        let beside = sides.into_iter().flatten().chain([(-wide / 2, -high - 7), (-wide / 2, 7)]);
        let is_free = |&(left, top): &(i64, i64)| {
            let (right, below) = (left + wide, top + high);
            let (most, lowest) = ((axes.x + axes.width) as i64, (axes.y + axes.height) as i64);
            let is_inside = left >= axes.x as i64 && right <= most && top >= axes.y as i64 && below <= lowest;
            is_inside && taken.iter().all(|[l, t, r, b]| left > *r || right < *l || top > *b || below < *t)
        };
        if let Some(place) = beside.map(|(dx, dy)| (x + dx, y + dy)).find(is_free) {
            canvas.text(place, name, Font::Strong.style(Align::Left, INK));
            taken.push([place.0, place.1, place.0 + wide, place.1 + high]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(series: &[(&str, &[(f64, f64)])]) -> Plot {
        let series =
            series.iter().map(|(n, p)| Series { name: (*n).to_owned(), points: p.to_vec() }).collect();
        let [title, x_label, y_label] = ["glass & <air>", "step", "PSNR [dB]"].map(str::to_owned);
        Plot { title, x_label, y_label, series, named: Vec::new() }
    }

    #[test]
    fn each_curve_is_drawn_in_its_colour() {
        let canvas = plot(&[("a", &[(0.0, 20.0), (100.0, 30.0)]), ("b", &[(0.0, 18.0), (100.0, 28.0)])])
            .draw(640, 400);
        assert_eq!((canvas.width(), canvas.height()), (640, 400));
        assert!(canvas.count(CURVES[0]) > 400 && canvas.count(CURVES[1]) > 400);
    }

    #[test]
    fn value_that_is_not_finite_interrupts_the_curve() {
        let whole = plot(&[("a", &[(0.0, 1.0), (1.0, 1.0), (2.0, 1.0), (3.0, 2.0)])]).draw(640, 400);
        let broken = plot(&[("a", &[(0.0, 1.0), (1.0, f64::NAN), (2.0, 1.0), (3.0, 2.0)])]).draw(640, 400);
        assert!(broken.count(CURVES[0]) < whole.count(CURVES[0]) - 200);
    }

    #[test]
    fn degenerate_data_still_gives_axes() {
        for points in [&[][..], &[(5.0, 7.0)], &[(0.0, f64::INFINITY)], &[(1.0, 3.0), (1.0, 3.0)]] {
            let canvas = plot(&[("a", points)]).draw(0, 0);
            assert!(canvas.count(FAINT) > 100, "{points:?}");
        }
        assert!(plot(&[]).draw(320, 200).count(FAINT) > 100);
    }

    #[test]
    fn named_points_are_marked_and_names_do_not_overlap() {
        let flat = plot(&[("a", &[(0.0, 20.0), (100.0, 30.0)])]);
        let named = |points: &[(f64, f64)]| {
            let name = |p: &(f64, f64)| NamedPoint { name: "IMG_0012.jpg".into(), point: *p };
            Plot { named: points.iter().map(name).collect(), ..flat.clone() }.draw(640, 400)
        };
        let ink = |canvas: &Canvas| canvas.count(INK);
        let [none, one, apart, crowd] =
            [&[][..], &[(50.0, 25.0)], &[(20.0, 28.0), (80.0, 22.0)], &[(50.0, 25.0); 30]].map(named);
        let each = ink(&one) - ink(&none);
        assert!(each > 100 && ink(&apart) - ink(&none) > 2 * each - 60);
        assert!(ink(&crowd) - ink(&none) < 8 * each, "names without room are left out");
    }
}
