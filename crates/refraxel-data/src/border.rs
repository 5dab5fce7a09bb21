//! Borders of masks: how far away they are, and masks whose border lies elsewhere.

use crate::image::Mask;

/// What counts as covered.
const COVERED: u8 = 127;
/// A border that bends comes so much nearer to where it was left behind straight [pixel].
const CROOKED: u32 = 2;

impl Mask {
    fn is_inside(&self, pixel: usize) -> bool {
        self.coverage[pixel] > COVERED
    }

    /// How far outside of the covered part the centre of pixel `row * width + column` lies [pixel]: negative inside, to within half a
    /// pixel. `None` where no border is as near as `reach`, and where that border parts no areas: where going straight on to the
    /// distance `reach` to either side of it leads to another border or out of the picture, as beside a straw in front of a glass that
    /// the mask leaves out.
    pub fn from_border(&self, pixel: usize, reach: u32) -> Option<f32> {
        let (away, outwards) = self.nearest_border(pixel, reach)?;
        let goes_on = |to: f32, inside: bool| {
            let [x, y] = [pixel % self.width as usize, pixel / self.width as usize];
            let [x, y] =
                [(x, outwards[0]), (y, outwards[1])].map(|(x, n)| (x as f32 + (to - away) * n).round());
            let fits = x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32;
            let there = fits.then(|| y as usize * self.width as usize + x as usize);
            let is_clear = |p| self.nearest_border(p, reach.saturating_sub(CROOKED)).is_none();
            there.is_some_and(|p| self.is_inside(p) == inside && is_clear(p))
        };
        (goes_on(reach as f32, false) && goes_on(-(reach as f32), true)).then_some(away)
    }

    /// Distance of the centre of a pixel from the nearest border [pixel], negative inside; `None` beyond `reach`.
    pub(crate) fn to_border(&self, pixel: usize, reach: u32) -> Option<f32> {
        self.nearest_border(pixel, reach).map(|(away, _)| away)
    }

    /// Distance [pixel], negative inside, and the direction outwards: between the middles of what is inside and outside around there.
    fn nearest_border(&self, pixel: usize, reach: u32) -> Option<(f32, [f32; 2])> {
        let (w, h, far) = (self.width as usize, self.height as usize, reach as usize + 1);
        let (x, y, own) = (pixel % w, pixel / w, self.is_inside(pixel));
        let (mut nearest, mut towards) = (usize::MAX, [0.0_f32; 2]);
        for v in y.saturating_sub(far)..(y + far + 1).min(h) {
            for u in x.saturating_sub(far)..(x + far + 1).min(w) {
                let squared = u.abs_diff(x).pow(2) + v.abs_diff(y).pow(2);
                if squared <= far * far && self.is_inside(v * w + u) != own {
                    nearest = nearest.min(squared);
                    towards[0] += u as f32 - x as f32;
                    towards[1] += v as f32 - y as f32;
                }
            }
        }
        // The border runs half-way between two pixels.
        let away = (nearest as f32).sqrt() - 0.5;
        let length = towards[0].hypot(towards[1]).max(f32::MIN_POSITIVE);
        // From inside the others lie outwards.
        let outwards = if own { 1.0 } else { -1.0 };
        let signed = if own { -away } else { away };
        (away <= reach as f32).then_some((signed, towards.map(|t| outwards * t / length)))
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
    fn borders_of_areas_leave_out_what_is_narrow() {
        let round = disc(12.0);
        let nearest = |mask: &Mask, p| mask.nearest_border(p, 5).map(|(away, _)| away);
        let mut slit = disc(12.0);
        let slit_at = |x: usize| (18..23).contains(&x);
        for p in (0..SIZE * SIZE).filter(|p| slit_at(p % SIZE)) {
            slit.coverage[p] = 0;
        }
        let mut bar = disc(0.0);
        for p in (0..SIZE * SIZE).filter(|p| slit_at(p % SIZE)) {
            bar.coverage[p] = 255;
        }
        for p in 0..SIZE * SIZE {
            assert_eq!(round.from_border(p, 5), nearest(&round, p), "a disc has none");
            assert_eq!(bar.from_border(p, 5), None);
            let (x, y) = (p % SIZE, p / SIZE);
            if slit_at(x) && y.abs_diff(20) < 8 {
                assert_eq!(slit.from_border(p, 5), None, "{x} {y}");
            }
            if !(8..=32).contains(&x) && y.abs_diff(20) < 3 {
                assert_eq!(slit.from_border(p, 5), nearest(&slit, p), "{x} {y}");
            }
        }
        let left = (0..SIZE * SIZE).filter(|&p| slit.from_border(p, 5).is_some()).count();
        assert!(left > 300, "{left} pixels of two halves are left");
    }

    #[test]
    fn borders_at_the_edge_of_the_picture_part_no_areas() {
        // Covered from the fourth column on.
        let coverage = (0..SIZE * SIZE).map(|p| if p % SIZE >= 3 { 255 } else { 0 }).collect();
        let mask = Mask { width: SIZE as u32, height: SIZE as u32, coverage };
        let middle = 20 * SIZE;
        assert_eq!(mask.from_border(middle + 4, 5), None);
        assert_eq!(mask.from_border(middle + 4, 2), Some(-1.5));
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
