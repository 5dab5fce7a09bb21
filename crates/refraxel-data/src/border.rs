//! Borders of masks: how far away they are, and masks whose border lies elsewhere.

use crate::image::Mask;

/// What counts as covered.
const COVERED: u8 = 127;

impl Mask {
    fn is_inside(&self, pixel: usize) -> bool {
        self.coverage[pixel] > COVERED
    }

    /// How far outside of the covered part the centre of pixel `row * width + column` lies [pixel]: negative inside, to within half a
    /// pixel. `None` where no border is as near as `reach`.
    pub fn from_border(&self, pixel: usize, reach: u32) -> Option<f32> {
        let (w, h, far) = (self.width as usize, self.height as usize, reach as usize + 1);
        let (x, y, own) = (pixel % w, pixel / w, self.is_inside(pixel));
        let rows = y.saturating_sub(far)..(y + far + 1).min(h);
        let others = rows.flat_map(|v| {
            let columns = x.saturating_sub(far)..(x + far + 1).min(w);
            let others = columns.filter(move |u| self.is_inside(v * w + u) != own);
            others.map(move |u| u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2))
        });
        // The border runs half-way between two pixels.
        let away = (others.min()? as f32).sqrt() - 0.5;
        (away <= reach as f32).then_some(if own { -away } else { away })
    }

    /// The same mask with its border this far further out [pixel], or further in where it is negative.
    #[must_use]
    pub fn shifted(&self, by: f32) -> Self {
        let (w, h) = (self.width as usize, self.height as usize);
        let grows = by > 0.0;
        let within = by.abs() + 0.5;
        let far = within.floor() as i64;
        let inside: Vec<bool> = (0..self.coverage.len()).map(|p| self.is_inside(p)).collect();
        // Pixels of the part that grows, beside the other: all that comes near to these changes sides.
        let borders = |x: usize, y: usize| {
            let p = y * w + x;
            let other = |q: usize| inside[q] != grows;
            inside[p] == grows
                && ((x > 0 && other(p - 1))
                    || (x + 1 < w && other(p + 1))
                    || (y > 0 && other(p - w))
                    || (y + 1 < h && other(p + w)))
        };
        let disc: Vec<(i64, i64)> = (-far..=far)
            .flat_map(|v| (-far..=far).map(move |u| (u, v)))
            .filter(|&(u, v)| ((u * u + v * v) as f32).sqrt() <= within)
            .collect();
        let mut out: Vec<u8> = inside.iter().map(|&i| if i { 255 } else { 0 }).collect();
        for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).filter(|&(x, y)| borders(x, y)) {
            for &(u, v) in &disc {
                let (x, y) = (x as i64 + u, y as i64 + v);
                if (0..w as i64).contains(&x) && (0..h as i64).contains(&y) {
                    out[(y * w as i64 + x) as usize] = if grows { 255 } else { 0 };
                }
            }
        }
        Self { width: self.width, height: self.height, coverage: out }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 41;

    /// A disc in the middle.
    fn disc(radius: f32) -> Mask {
        let from_middle = |p: usize| {
            let [x, y] = [p % SIZE, p / SIZE].map(|v| v as f32 - 20.0);
            x.hypot(y)
        };
        let coverage = (0..SIZE * SIZE).map(|p| if from_middle(p) <= radius { 255 } else { 0 }).collect();
        Mask { width: SIZE as u32, height: SIZE as u32, coverage }
    }

    #[test]
    fn distances_from_the_border_of_a_disc_are_right_to_a_pixel() {
        let mask = disc(12.0);
        for p in 0..SIZE * SIZE {
            let [x, y] = [p % SIZE, p / SIZE].map(|v| v as f32 - 20.0);
            let true_one = x.hypot(y) - 12.0;
            match mask.from_border(p, 4) {
                Some(away) => assert!((away - true_one).abs() < 1.0, "{away} for {true_one}"),
                None => assert!(true_one.abs() > 3.3, "{true_one}"),
            }
        }
    }

    #[test]
    fn a_disc_grows_and_shrinks_and_stays_one() {
        for by in [-5.0_f32, -3.0, -1.0, 0.0, 1.0, 2.5, 6.0] {
            let (got, wanted) = (disc(12.0).shifted(by), disc(12.0 + by));
            let wrong = got.coverage.iter().zip(&wanted.coverage).filter(|(a, b)| a != b).count();
            // Along the whole border, off by less than half a pixel.
            let border = 2.0 * std::f32::consts::PI * (12.0 + by);
            assert!(wrong as f32 <= 0.5 * border, "{by}: {wrong} pixels along {border}");
        }
    }

    #[test]
    fn a_shift_at_the_edge_of_the_picture_stays_within_it() {
        let mut coverage = vec![0; 12];
        coverage[3] = 255; // the upper right corner of 4 × 3 pixels
        let corner = Mask { width: 4, height: 3, coverage };
        assert_eq!(corner.shifted(1.0).coverage, [0, 0, 255, 255, 0, 0, 255, 255, 0, 0, 0, 0]);
        assert!(corner.shifted(-1.0).coverage.iter().all(|c| *c == 0));
        assert!(corner.shifted(9.0).coverage.iter().all(|c| *c == 255));
    }
}
