use super::surface::{Canvas, Colour};

impl Canvas {
    /// Draws connected segments `width` [pixel] wide, with round joints and a soft edge of one pixel.
    ///
    /// Points are in pixels, the centre of the top left pixel at (0.5, 0.5). One point alone is a dot.
    pub fn polyline(&mut self, points: &[(f64, f64)], width: f64, colour: Colour) {
        let Some(mut cover) = Cover::around(points, width, (self.width(), self.height())) else { return };
        if let [point] = points {
            cover.add(*point, *point, width);
        }
        for ends in points.windows(2) {
            cover.add(ends[0], ends[1], width);
        }
        for (k, &opacity) in cover.opacity.iter().enumerate().filter(|(_, o)| **o > 0.0) {
            let (x, y) = (cover.left + k % cover.columns, cover.top + k / cover.columns);
            self.mix(x as i64, y as i64, colour, opacity);
        }
    }
}

/// How much of each pixel of a rectangle is covered; segments that overlap do not add up.
struct Cover {
    left: usize,
    top: usize,
    columns: usize,
    rows: usize,
    opacity: Vec<f32>,
}

impl Cover {
    /// The pixels that a line through `points` can touch; `None` when these are none, or a point is not finite.
    fn around(points: &[(f64, f64)], width: f64, size: (usize, usize)) -> Option<Self> {
        let range = |axis: fn(&(f64, f64)) -> f64, limit: usize| {
            let low = points.iter().map(axis).fold(f64::INFINITY, f64::min) - width / 2.0 - 1.0;
            let high = points.iter().map(axis).fold(f64::NEG_INFINITY, f64::max) + width / 2.0 + 1.0;
            let (low, high) = (low.max(0.0) as usize, high.clamp(0.0, limit as f64).ceil() as usize);
            (low < high).then(|| (low, high - low))
        };
        if points.iter().any(|p| !p.0.is_finite() || !p.1.is_finite()) {
            return None;
        }
        let (left, columns) = range(|p| p.0, size.0)?;
        let (top, rows) = range(|p| p.1, size.1)?;
        Some(Self { left, top, columns, rows, opacity: vec![0.0; columns * rows] })
    }

    fn add(&mut self, a: (f64, f64), b: (f64, f64), width: f64) {
        let reach = width / 2.0 + 1.0;
        let span = |a: f64, b: f64, start: usize, count: usize| {
            let low = (a.min(b) - reach - start as f64).max(0.0) as usize;
            let high = (a.max(b) + reach - start as f64).max(0.0).ceil() as usize;
            low..high.min(count)
        };
        for row in span(a.1, b.1, self.top, self.rows) {
            for column in span(a.0, b.0, self.left, self.columns) {
                let centre = ((self.left + column) as f64 + 0.5, (self.top + row) as f64 + 0.5);
                let cover = (width / 2.0 + 0.5 - distance(centre, a, b)).clamp(0.0, width.min(1.0)) as f32;
                let opacity = &mut self.opacity[row * self.columns + column];
                *opacity = opacity.max(cover);
            }
        }
    }
}

/// From a point to the segment between `a` and `b`.
fn distance(point: (f64, f64), a: (f64, f64), b: (f64, f64)) -> f64 {
    let (along, to) = ((b.0 - a.0, b.1 - a.1), (point.0 - a.0, point.1 - a.1));
    let length2 = along.0 * along.0 + along.1 * along.1;
    let t = if length2 > 0.0 { ((to.0 * along.0 + to.1 * along.1) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (to.0 - t * along.0).hypot(to.1 - t * along.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: Colour = [255; 3];

    #[test]
    fn line_through_pixel_centres_fills_them() {
        let mut canvas = Canvas::new(8, 3, WHITE);
        canvas.polyline(&[(0.5, 1.5), (7.5, 1.5)], 1.0, [0; 3]);
        for x in 0..8 {
            assert_eq!([0, 1, 2].map(|y| canvas.pixel(x, y)[0]), [255, 0, 255], "column {x}");
        }
    }

    #[test]
    fn line_between_pixel_centres_is_shared_by_both_rows() {
        let mut canvas = Canvas::new(8, 4, WHITE);
        canvas.polyline(&[(0.0, 2.0), (8.0, 2.0)], 1.0, [0; 3]);
        assert_eq!([0, 1, 2, 3].map(|y| canvas.pixel(4, y)[0]), [255, 128, 128, 255]);
    }

    #[test]
    fn joints_are_not_darker_than_the_line() {
        let mut canvas = Canvas::new(9, 4, WHITE);
        canvas.polyline(&[(0.0, 2.0), (4.5, 2.0), (9.0, 2.0)], 1.0, [0; 3]);
        assert_eq!(canvas.pixel(4, 1), canvas.pixel(2, 1));
    }

    #[test]
    fn far_and_infinite_points_are_harmless() {
        let mut canvas = Canvas::new(4, 4, WHITE);
        canvas.polyline(&[(-1e9, 2.5), (1e9, 2.5)], 1.0, [0; 3]);
        assert_eq!(canvas.pixel(2, 2), [0; 3]);
        let before = canvas.clone();
        canvas.polyline(&[(f64::NAN, 0.0), (1.0, f64::INFINITY)], 1.0, [9; 3]);
        canvas.polyline(&[(-50.0, -50.0), (-40.0, -40.0)], 1.0, [9; 3]);
        canvas.polyline(&[], 1.0, [9; 3]);
        assert_eq!(canvas, before);
    }
}
