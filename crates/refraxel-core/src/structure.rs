//! How alike two pictures are in their structure, whatever their brightness and contrast: local normalised
//! cross-correlation of high-passed luminance, theory (4.24), and its transpose.
//!
//! A prediction through glass has the right edges in the right places long before it has the right colours: absorption,
//! reflection, exposure and the blur of a field change brightness, and squared differences of colour count little else.
//!
//! ```
//! use refraxel_core::structure::{Pictures, Structure};
//! let size = [40, 30];
//! let waves = |k: usize, phase: f64| (0.9 * (k % 40) as f64 + phase).sin() * (0.7 * (k / 40) as f64).cos();
//! let photograph: Vec<f64> = (0..1200).map(|k| waves(k, 0.0)).collect();
//! // Darker, of less contrast: the same structure. Moved by half a wave: the opposite.
//! let faded: Vec<f64> = photograph.iter().map(|v| 0.1 + 0.4 * v).collect();
//! let moved: Vec<f64> = (0..1200).map(|k| waves(k, 3.1416)).collect();
//! let weight = vec![1.0; 1200];
//! let score = |shown: &[f64]| {
//!     let pictures = Pictures { size, shown, photograph: &photograph, weight: &weight };
//!     Structure::new(4.0, 2.0).similarity(&pictures).unwrap().score
//! };
//! assert!(score(&faded) > 0.999 && score(&moved) < -0.999);
//! ```

use crate::Real;
use crate::grid::{Border, GaussianKernel};

/// Weights of red, green and blue in luminance [1], Rec. 601, of code values.
pub const LUMINANCE: [f64; 3] = [0.299, 0.587, 0.114];

/// Added to each variance [code value²]: texture of a standard deviation below 0.0045, about one step of 8 bits, counts as none.
const FLOOR: f64 = 2e-5;
/// A window counts where this part of it lies on pixels that count.
const FILLED: f64 = 0.6;
/// Fewer pixels say nothing.
const LEAST_PIXELS: usize = 30;
/// Where Gaussians are cut off, in their standard deviation: 0.3 % of the weight lies beyond.
const REACH: f64 = 3.0;
/// Least weight that is divided by.
const LEAST_WEIGHT: f64 = 1e-3;

/// The luminance of a colour.
pub fn luminance<T: Real>(colour: [T; 3]) -> T {
    (0..3).map(|c| T::of(LUMINANCE[c]) * colour[c]).sum()
}

/// The comparison, theory (4.24).
#[derive(Clone, Debug)]
pub struct Structure<T> {
    high_pass: GaussianKernel<T>,
    window: GaussianKernel<T>,
}

/// Two pictures of one view, x fastest.
#[derive(Clone, Copy, Debug)]
pub struct Pictures<'a, T> {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Luminance that a model shows [code value].
    pub shown: &'a [T],
    /// Luminance of the photograph [code value].
    pub photograph: &'a [T],
    /// 1 where a pixel counts, 0 where not. Gradients need 0 along the border of the picture, where the blur is not its own transpose.
    pub weight: &'a [T],
}

/// What a comparison found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Mean correlation, weighted by the texture of the photograph, −1 to 1.
    pub score: f64,
    /// Pixels that were compared.
    pub pixels: usize,
}

/// High-passed pictures and their moments in the window around each pixel.
struct Moments<T> {
    shown: Vec<T>,
    photograph: Vec<T>,
    /// Low-passed weight, and that in the windows.
    low: Vec<T>,
    filled: Vec<T>,
    mean_shown: Vec<T>,
    mean_photograph: Vec<T>,
    /// Variances, the floor included, and covariance.
    variance_shown: Vec<T>,
    variance_photograph: Vec<T>,
    covariance: Vec<T>,
    /// The texture of the photograph by which a pixel counts; 0 where its window is not filled.
    texture: Vec<T>,
    pixels: usize,
}

impl<T: Real> Structure<T> {
    /// A comparison of what varies over less than a Gaussian of `high_pass` > 0, in windows of standard deviation
    /// `window` > 0 [pixel].
    pub fn new(high_pass: f64, window: f64) -> Self {
        let kernel = |sigma: f64| {
            GaussianKernel::new(T::of(sigma), (REACH * sigma).ceil() as usize, Border::Continued)
        };
        Self { high_pass: kernel(high_pass), window: kernel(window) }
    }

    /// How alike two pictures are; `None` where too few pixels count or the photograph has no texture.
    ///
    /// # Panics
    /// If the pictures are not of the stated size.
    pub fn similarity(&self, pictures: &Pictures<T>) -> Option<Similarity> {
        self.moments(pictures).similarity()
    }

    /// Per pixel the correlation in its window, 0 where that is not filled: for pictures.
    ///
    /// # Panics
    /// If the pictures are not of the stated size.
    pub fn map(&self, pictures: &Pictures<T>) -> Vec<T> {
        let moments = self.moments(pictures);
        (0..moments.texture.len()).map(|k| moments.correlation(k)).collect()
    }

    /// The same with dScore/d`shown`, the transpose of [`Self::similarity`]; which windows are filled is held fixed.
    ///
    /// # Panics
    /// If the pictures are not of the stated size.
    pub fn similarity_vjp(&self, pictures: &Pictures<T>) -> Option<(Similarity, Vec<T>)> {
        let m = self.moments(pictures);
        let similarity = m.similarity()?;
        let total: T = m.texture.iter().copied().sum();
        let (n, half, two) = (m.texture.len(), T::of(0.5), T::of(2.0));
        let (mut d_product, mut d_square, mut d_mean) =
            (vec![T::zero(); n], vec![T::zero(); n], vec![T::zero(); n]);
        for k in (0..n).filter(|&k| m.texture[k] > T::zero()) {
            // forward: score += texture / total · covariance / √(variance_shown variance_photograph)
            let weight = m.texture[k] / total / (m.variance_shown[k] * m.variance_photograph[k]).sqrt();
            let d_covariance = weight;
            let is_clamped = m.variance_shown[k] <= T::of(FLOOR);
            let d_variance =
                if is_clamped { T::zero() } else { -half * weight * m.covariance[k] / m.variance_shown[k] };
            // forward: covariance = G(p q)/W − mean_shown mean_photograph; variance = G(p²)/W − mean_shown²
            d_product[k] = d_covariance / m.filled[k];
            d_square[k] = d_variance / m.filled[k];
            d_mean[k] =
                (-d_covariance * m.mean_photograph[k] - two * d_variance * m.mean_shown[k]) / m.filled[k];
        }
        let width = pictures.size[0];
        for d in [&mut d_product, &mut d_square, &mut d_mean] {
            blur(&self.window, d, width);
        }
        // forward: p = (shown − G(shown w)/g) w
        let mut d_p: Vec<T> = (0..n)
            .map(|k| {
                pictures.weight[k]
                    * (m.photograph[k] * d_product[k] + two * m.shown[k] * d_square[k] + d_mean[k])
            })
            .collect();
        let mut d_low: Vec<T> = d_p.iter().zip(&m.low).map(|(d, low)| *d / *low).collect();
        blur(&self.high_pass, &mut d_low, width);
        (d_p.iter_mut().zip(&d_low).zip(pictures.weight)).for_each(|((d, low), w)| *d -= *w * *low);
        Some((similarity, d_p))
    }

    fn moments(&self, pictures: &Pictures<T>) -> Moments<T> {
        let Pictures { size: [width, height], shown, photograph, weight } = *pictures;
        let n = width * height;
        let fits = [shown, photograph, weight].iter().all(|p| p.len() == n);
        assert!(fits, "pictures of {width} × {height} pixels have {n} values each");
        let least = T::of(LEAST_WEIGHT);
        let low: Vec<T> =
            self.blurred(&self.high_pass, weight, width).into_iter().map(|g| g.max(least)).collect();
        let high = |picture: &[T]| self.high_passed(picture, weight, &low, width);
        let (p, q) = (high(shown), high(photograph));
        let filled_by = self.blurred(&self.window, weight, width);
        let filled: Vec<T> = filled_by.iter().map(|w| w.max(least)).collect();
        let mean = |of: &[T]| divided(self.blurred(&self.window, of, width), &filled);
        let product = |a: &[T], b: &[T]| -> Vec<T> { a.iter().zip(b).map(|(a, b)| *a * *b).collect() };
        let (mean_shown, mean_photograph) = (mean(&p), mean(&q));
        let floor = T::of(FLOOR);
        let variance = |of: &[T], means: &[T]| -> Vec<T> {
            let squares = mean(&product(of, of));
            squares.iter().zip(means).map(|(s, m)| (*s - *m * *m).max(T::zero()) + floor).collect()
        };
        let variance_shown = variance(&p, &mean_shown);
        let variance_photograph = variance(&q, &mean_photograph);
        let products = mean(&product(&p, &q));
        let covariance = (0..n).map(|k| products[k] - mean_shown[k] * mean_photograph[k]).collect();
        let counts = |k: &usize| weight[*k] > T::zero() && filled_by[*k] > T::of(FILLED);
        let mut texture = vec![T::zero(); n];
        for k in (0..n).filter(counts) {
            texture[k] = (variance_photograph[k] - floor).sqrt();
        }
        let pixels = (0..n).filter(counts).count();
        Moments {
            shown: p,
            photograph: q,
            low,
            filled,
            mean_shown,
            mean_photograph,
            variance_shown,
            variance_photograph,
            covariance,
            texture,
            pixels,
        }
    }

    /// p = (P − G(P w)/G(w)) w.
    fn high_passed(&self, picture: &[T], weight: &[T], low: &[T], width: usize) -> Vec<T> {
        let weighted: Vec<T> = picture.iter().zip(weight).map(|(p, w)| *p * *w).collect();
        let smooth = divided(self.blurred(&self.high_pass, &weighted, width), low);
        (0..picture.len()).map(|k| (picture[k] - smooth[k]) * weight[k]).collect()
    }

    fn blurred(&self, kernel: &GaussianKernel<T>, picture: &[T], width: usize) -> Vec<T> {
        let mut out = picture.to_vec();
        blur(kernel, &mut out, width);
        out
    }
}

impl<T: Real> Moments<T> {
    fn correlation(&self, k: usize) -> T {
        if self.texture[k] > T::zero() {
            self.covariance[k] / (self.variance_shown[k] * self.variance_photograph[k]).sqrt()
        } else {
            T::zero()
        }
    }

    fn similarity(&self) -> Option<Similarity> {
        let (mut sum, mut total) = (0.0, 0.0);
        for (k, texture) in self.texture.iter().enumerate() {
            sum += (*texture * self.correlation(k)).f64();
            total += texture.f64();
        }
        let says_something = self.pixels >= LEAST_PIXELS && total > 0.0;
        says_something.then(|| Similarity { score: sum / total, pixels: self.pixels })
    }
}

/// Blurs a picture along its rows and columns. The border of pictures repeats, so that the blur is its own transpose where that
/// is 0.
fn blur<T: Real>(kernel: &GaussianKernel<T>, picture: &mut [T], width: usize) {
    kernel.along_rows(picture, width);
    kernel.across_rows(picture, width);
}

fn divided<T: Real>(mut values: Vec<T>, by: &[T]) -> Vec<T> {
    values.iter_mut().zip(by).for_each(|(v, by)| *v /= *by);
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [44, 38];
    const N: usize = SIZE[0] * SIZE[1];

    fn texture(k: usize, seed: f64) -> f64 {
        let (x, y) = ((k % SIZE[0]) as f64, (k / SIZE[0]) as f64);
        0.5 + 0.2 * (0.9 * x + seed).sin() * (0.6 * y - seed).cos() + 0.1 * (1.7 * x - 0.8 * y * seed).sin()
    }

    /// A disc, far from the border.
    fn disc() -> Vec<f64> {
        let centre = [0.5 * SIZE[0] as f64, 0.5 * SIZE[1] as f64];
        let inside = |k: usize| {
            let (x, y) = ((k % SIZE[0]) as f64 - centre[0], (k / SIZE[0]) as f64 - centre[1]);
            x.hypot(y) < 11.0
        };
        (0..N).map(|k| if inside(k) { 1.0 } else { 0.0 }).collect()
    }

    fn similarity(shown: &[f64], photograph: &[f64], weight: &[f64]) -> Similarity {
        Structure::new(4.0, 2.0).similarity(&Pictures { size: SIZE, shown, photograph, weight }).unwrap()
    }

    #[test]
    fn brightness_and_contrast_do_not_matter_and_what_lies_outside_of_the_mask_does_not() {
        let (weight, photograph) = (disc(), (0..N).map(|k| texture(k, 1.0)).collect::<Vec<_>>());
        let shown: Vec<f64> =
            (0..N).map(|k| if weight[k] > 0.0 { 0.2 + 0.5 * photograph[k] } else { 7.0 }).collect();
        let found = similarity(&shown, &photograph, &weight);
        assert!(found.score > 0.995, "{found:?}");
        assert!(found.pixels > 300 && found.pixels < weight.iter().filter(|w| **w > 0.0).count() + 1);
        let other: Vec<f64> = (0..N).map(|k| texture(k, 2.3)).collect();
        assert!(similarity(&other, &photograph, &weight).score < 0.3);
        let swapped = similarity(&photograph, &shown, &weight);
        assert!((swapped.score - found.score).abs() < 5e-3);
    }

    #[test]
    fn a_picture_without_texture_or_with_a_tiny_mask_says_nothing() {
        let (plain, weight) = (vec![0.4; N], disc());
        let structure = Structure::new(4.0, 2.0);
        let textured: Vec<f64> = (0..N).map(|k| texture(k, 1.0)).collect();
        let of = |photograph: &[f64], weight: &[f64]| {
            structure.similarity(&Pictures { size: SIZE, shown: &textured, photograph, weight })
        };
        assert_eq!(of(&textured, &vec![0.0; N]), None);
        assert!(of(&plain, &weight).is_none_or(|s| s.score.abs() < 1e-3));
        assert!(of(&textured, &weight).is_some());
    }

    #[test]
    fn the_transpose_is_the_gradient() {
        const STEP: f64 = 1e-5;
        const TOL: f64 = 1e-7; // h² times the third derivative, relative to the largest entry
        let (weight, photograph) = (disc(), (0..N).map(|k| texture(k, 1.0)).collect::<Vec<_>>());
        let shown: Vec<f64> = (0..N).map(|k| texture(k, 1.4)).collect();
        let structure = Structure::new(4.0, 2.0);
        let pictures = Pictures { size: SIZE, shown: &shown, photograph: &photograph, weight: &weight };
        let (found, d_shown) = structure.similarity_vjp(&pictures).unwrap();
        assert_eq!(found, structure.similarity(&pictures).unwrap());
        for k in (0..N).filter(|k| k % 37 == 5) {
            let at = |by: f64| {
                let mut moved = shown.clone();
                moved[k] += by;
                similarity(&moved, &photograph, &weight).score
            };
            let slope = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            assert!((d_shown[k] - slope).abs() < TOL, "{k}: {} {slope}", d_shown[k]);
        }
        assert!(d_shown.iter().map(|d| d.abs()).fold(0.0, f64::max) > 1e-3);
    }
}
