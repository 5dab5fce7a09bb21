//! A plot as pixels or as SVG.

use super::curves::Plot;
use super::marks::{Frame, marks};
use super::svg;
use crate::canvas::{Canvas, PAPER};

impl Plot {
    /// Draws the plot; sizes below 320×200 pixels are raised to that.
    pub fn draw(&self, width: usize, height: usize) -> Canvas {
        let frame = Frame::new(self, width, height);
        let mut canvas = Canvas::new(frame.width, frame.height, PAPER);
        for mark in marks(self, &frame) {
            mark.draw(&mut canvas);
        }
        canvas
    }

    /// Writes the plot as a self-contained SVG document of the same layout.
    pub fn svg(&self, width: usize, height: usize) -> String {
        let frame = Frame::new(self, width, height);
        svg::document(frame.width, frame.height, &marks(self, &frame))
    }
}

#[cfg(test)]
mod tests {
    use super::super::curves::{NamedPoint, Series};
    use super::super::marks::CURVES;
    use super::*;
    use crate::canvas::{FAINT, INK};

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

    #[test]
    fn svg_is_well_formed_and_escapes_text() {
        let svg = plot(&[("a", &[(0.0, 20.0), (100.0, 30.0)])]).svg(640, 400);
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
        assert!(svg.contains("glass &amp; &lt;air&gt;") && !svg.contains("<air>"));
        assert!(svg.contains("<circle") && svg.contains("<polyline"));
    }
}
