//! A picture laid over the ground.

use super::color::Rgb;
use refraxel_core::Vec3;
use std::sync::Arc;

/// A picture over the rectangle `min..max` of the (x, y) plane, bilinear between pixel centres, clamped at its edges.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height [pixel].
    pub size: [usize; 2],
    /// Linear colours, row by row; row 0 lies at `min[1]`.
    pub pixels: Arc<Vec<Rgb>>,
    /// Smallest (x, y) [scene unit].
    pub min: [f64; 2],
    /// Largest (x, y) [scene unit].
    pub max: [f64; 2],
}

impl Picture {
    pub(super) fn color(&self, x: Vec3<f64>) -> Rgb {
        let mut corner = [0; 2];
        let mut t = [0.0; 2];
        for a in 0..2 {
            let last = self.size[a] - 1;
            let p = (x[a] - self.min[a]) / (self.max[a] - self.min[a]) * self.size[a] as f64 - 0.5;
            let p = p.clamp(0.0, last as f64);
            corner[a] = (p.floor() as usize).min(last.saturating_sub(1));
            t[a] = p - corner[a] as f64;
        }
        let at = |dx: usize, dy: usize| {
            let [i, j] = [(corner[0] + dx).min(self.size[0] - 1), (corner[1] + dy).min(self.size[1] - 1)];
            self.pixels[j * self.size[0] + i]
        };
        let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
        [0, 1, 2].map(|k| {
            (a[k] * (1.0 - t[0]) + b[k] * t[0]) * (1.0 - t[1]) + (c[k] * (1.0 - t[0]) + d[k] * t[0]) * t[1]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    #[test]
    fn a_picture_shows_its_pixels_at_their_centres_and_blends_between() {
        let pixels = vec![[0.0; 3], [1.0; 3], [0.5; 3], [0.25; 3]];
        let picture = Picture { size: [2, 2], pixels: Arc::new(pixels), min: [-1.0; 2], max: [1.0; 2] };
        assert_eq!(picture.color(vec3(0.5, -0.5, 9.0)), [1.0; 3]);
        assert_eq!(picture.color(vec3(0.0, -0.5, 9.0)), [0.5; 3]);
        assert_eq!(picture.color(vec3(-3.0, 3.0, 0.0)), [0.5; 3]);
    }
}
