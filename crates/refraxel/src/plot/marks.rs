//! A plot as a list of marks at pixel positions, before it becomes pixels or SVG.

use super::curves::{NamedPoint, Plot, Series};
use super::ticks::{rounded, ticks};
use crate::canvas::{Align, Canvas, Colour, FAINT, Font, INK, PALE, Rect, Style, text_width};

/// Told apart with every kind of colour vision: Okabe & Ito 2008, blue, vermilion, green, purple.
pub(super) const CURVES: [Colour; 4] = [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167]];

/// One thing to draw.
pub enum Mark {
    Line {
        points: Vec<(f64, f64)>,
        width: f64,
        colour: Colour,
    },
    Dot {
        centre: (f64, f64),
        diameter: f64,
        colour: Colour,
    },
    /// A line of text whose upper edge is at y.
    Text {
        place: (i64, i64),
        text: String,
        style: Style,
    },
}

/// Curves with at most so many points show each as a dot.
const DOTTED: usize = 60;

/// Where the axes lie and how values map to pixels.
pub struct Frame {
    pub width: usize,
    pub height: usize,
    axes: Rect,
    x: (f64, f64),
    y: (f64, f64),
    /// Wished number of ticks along x and y.
    counts: (usize, usize),
}

impl Frame {
    pub fn new(plot: &Plot, width: usize, height: usize) -> Self {
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

/// Everything there is to draw, from back to front.
pub fn marks(plot: &Plot, frame: &Frame) -> Vec<Mark> {
    let mut marks = Vec::new();
    axes(frame, &mut marks);
    labels(plot, frame, &mut marks);
    for (series, &colour) in plot.series.iter().zip(CURVES.iter().cycle()) {
        curve(series, frame, colour, &mut marks);
    }
    last_values(&plot.series, frame, &mut marks);
    names(&plot.named, frame, &mut marks);
    marks
}

fn text(place: (i64, i64), text: &str, style: Style) -> Mark {
    Mark::Text { place, text: text.to_owned(), style }
}

fn axes(frame: &Frame, marks: &mut Vec<Mark>) {
    let (xs, x_decimals) = ticks(frame.x.0, frame.x.1, frame.counts.0);
    let (ys, y_decimals) = ticks(frame.y.0, frame.y.1, frame.counts.1);
    let line = |points, colour| Mark::Line { points, width: 1.0, colour };
    let crisp = |v: f64| v.floor() + 0.5; // on pixel centres
    let (bottom, half) = (frame.axes.y + frame.axes.height, Font::Body.height() as i64 / 2);
    let (left, right) = (frame.axes.x as f64, (frame.axes.x + frame.axes.width) as f64);
    for y in ys {
        let at = crisp(frame.place((frame.x.0, y)).1);
        marks.push(line(vec![(left, at), (right, at)], PALE));
        let place = (frame.axes.x as i64 - 8, at as i64 - half);
        marks.push(text(place, &format!("{y:.y_decimals$}"), Font::Body.style(Align::Right, FAINT)));
    }
    for x in xs {
        let at = crisp(frame.place((x, frame.y.0)).0);
        marks.push(line(vec![(at, bottom as f64 + 1.0), (at, bottom as f64 + 6.0)], FAINT));
        let place = (at as i64, bottom as i64 + 8);
        marks.push(text(place, &format!("{x:.x_decimals$}"), Font::Body.style(Align::Centre, FAINT)));
    }
    let at = crisp(bottom as f64);
    marks.push(line(vec![(left, at), (right, at)], FAINT));
}

fn labels(plot: &Plot, frame: &Frame, marks: &mut Vec<Mark>) {
    let (axes, line) = (frame.axes, Font::Body.height() as i64);
    marks.push(text((16, 14), &plot.title, Font::Heading.style(Align::Left, INK)));
    let above = axes.y as i64 - line - 12;
    marks.push(text((16, above), &plot.y_label, Font::Body.style(Align::Left, FAINT)));
    let below = ((axes.x + axes.width / 2) as i64, (axes.y + axes.height) as i64 + 12 + line);
    marks.push(text(below, &plot.x_label, Font::Body.style(Align::Centre, FAINT)));
    let mut right = (axes.x + axes.width) as i64;
    let named: Vec<_> = plot.series.iter().zip(CURVES.iter().cycle()).collect();
    for (series, &colour) in named.into_iter().rev() {
        marks.push(text((right, above), &series.name, Font::Body.style(Align::Right, INK)));
        right -= text_width(Font::Body, &series.name) as i64 + 8;
        let y = (above + line / 2) as f64 + 0.5;
        marks.push(Mark::Line {
            points: vec![(right as f64 - 20.0, y), (right as f64, y)],
            width: 3.0,
            colour,
        });
        right -= 20 + 20;
    }
}

fn curve(series: &Series, frame: &Frame, colour: Colour, marks: &mut Vec<Mark>) {
    let dotted = series.points.len() <= DOTTED;
    let width = if dotted { 2.0 } else { 1.3 };
    for piece in series.points.split(|p| !p.0.is_finite() || !p.1.is_finite()).filter(|p| !p.is_empty()) {
        let points: Vec<_> = piece.iter().map(|&p| frame.place(p)).collect();
        if dotted {
            marks.extend(points.iter().map(|&centre| Mark::Dot { centre, diameter: 6.0, colour }));
        }
        marks.push(Mark::Line { points, width, colour });
    }
}

/// Writes the last value of each curve at its right end, moved apart where they would overlap.
fn last_values(series: &[Series], frame: &Frame, marks: &mut Vec<Mark>) {
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
        marks.push(text((x, y as i64), &format!("{value:.2}"), Font::Strong.style(Align::Left, colour)));
    }
}

/// Named points as dots, with their names on that side of them where nothing else is written.
fn names(named: &[NamedPoint], frame: &Frame, marks: &mut Vec<Mark>) {
    let (high, axes) = (Font::Strong.height() as i64, frame.axes);
    let mut taken: Vec<[i64; 4]> = Vec::new();
    for NamedPoint { name, point } in named.iter().filter(|n| n.point.0.is_finite() && n.point.1.is_finite())
    {
        let centre = frame.place(*point);
        marks.push(Mark::Dot { centre, diameter: 9.0, colour: INK });
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
            marks.push(text(place, name, Font::Strong.style(Align::Left, INK)));
            taken.push([place.0, place.1, place.0 + wide, place.1 + high]);
        }
    }
}

impl Mark {
    pub fn draw(&self, canvas: &mut Canvas) {
        match self {
            Self::Line { points, width, colour } => canvas.polyline(points, *width, *colour),
            Self::Dot { centre, diameter, colour } => canvas.polyline(&[*centre], *diameter, *colour),
            Self::Text { place, text, style } => canvas.text(*place, text, *style),
        }
    }
}
