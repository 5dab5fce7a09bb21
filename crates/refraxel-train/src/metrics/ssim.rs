//! Structural similarity, Wang et al. 2004, "Image quality assessment: from error visibility to structural similarity".

use super::error::MetricsError;
use super::rgb8::{Rgb8, same_size};

/// Side of the window [pixel].
const WINDOW: usize = 11;
/// Standard deviation of the Gaussian window [pixel].
const SIGMA: f64 = 1.5;
/// (k1 L)² with k1 = 0.01 and values in a range of L = 1.
const C1: f32 = 0.01 * 0.01;
/// (k2 L)² with k2 = 0.03 and values in a range of L = 1.
const C2: f32 = 0.03 * 0.03;
/// Subtracted from values before squaring: variances stay, f32 rounding of flat bright regions shrinks.
const CENTRE: f32 = 0.5;

/// Mean structural similarity [1], theory (5.3), over RGB and over the windows that lie inside the image; 1 for equal
/// images.
///
/// `None` when a side is below 11 pixels. Variances are those of the window's population.
/// Agrees with scikit-image (`gaussian_weights=True, sigma=1.5, use_sample_covariance=False`) to 1e-6.
pub fn ssim(render: Rgb8<'_>, truth: Rgb8<'_>) -> Result<Option<f64>, MetricsError> {
    same_size(render, truth)?;
    let (width, height) = truth.size();
    if width < WINDOW || height < WINDOW {
        return Ok(None);
    }
    let taps = window();
    let values = byte_values();
    let row = |image: Rgb8<'_>, y: usize| -> Vec<f32> {
        let pixels = &image.pixels()[y * width..(y + 1) * width];
        pixels.iter().flatten().map(|&v| values[usize::from(v)]).collect()
    };
    let mut rows = Moments::zeros(3 * width);
    let mut windows = Moments::zeros(3 * (width + 1 - WINDOW));
    let (a, b): (Vec<_>, Vec<_>) = (0..height).map(|y| (row(render, y), row(truth, y))).unzip();
    let mut sum = 0.0;
    for y in 0..=height - WINDOW {
        rows.clear();
        for (k, &tap) in taps.iter().enumerate() {
            rows.add_row(tap, &a[y + k], &b[y + k]);
        }
        windows.clear();
        for (k, &tap) in taps.iter().enumerate() {
            windows.add_shifted(tap, &rows, 3 * k); // three channels side by side
        }
        sum += windows.similarity();
    }
    Ok(Some(sum / (windows.a.len() * (height + 1 - WINDOW)) as f64))
}

/// Weighted means of a, b, a² + b² and ab at each place of an image row; the channel runs fastest.
struct Moments {
    a: Vec<f32>,
    b: Vec<f32>,
    squares: Vec<f32>,
    product: Vec<f32>,
}

impl Moments {
    fn zeros(n: usize) -> Self {
        Self { a: vec![0.0; n], b: vec![0.0; n], squares: vec![0.0; n], product: vec![0.0; n] }
    }

    fn clear(&mut self) {
        for plane in [&mut self.a, &mut self.b, &mut self.squares, &mut self.product] {
            plane.fill(0.0);
        }
    }

    fn add_row(&mut self, tap: f32, a: &[f32], b: &[f32]) {
        let n = self.a.len();
        let (a, b) = (&a[..n], &b[..n]);
        let (sum_a, sum_b) = (&mut self.a[..n], &mut self.b[..n]);
        let (squares, product) = (&mut self.squares[..n], &mut self.product[..n]);
        for i in 0..n {
            sum_a[i] += tap * a[i];
            sum_b[i] += tap * b[i];
            squares[i] += tap * (a[i] * a[i] + b[i] * b[i]);
            product[i] += tap * (a[i] * b[i]);
        }
    }

    fn add_shifted(&mut self, tap: f32, rows: &Self, shift: usize) {
        let add = |sum: &mut [f32], plane: &[f32]| {
            for (s, v) in sum.iter_mut().zip(&plane[shift..]) {
                *s += tap * v;
            }
        };
        add(&mut self.a, &rows.a);
        add(&mut self.b, &rows.b);
        add(&mut self.squares, &rows.squares);
        add(&mut self.product, &rows.product);
    }

    /// Sum of the similarity of all windows of the row.
    fn similarity(&self) -> f64 {
        let one = |i: usize| {
            let (a, b) = (self.a[i], self.b[i]);
            let variances = self.squares[i] - a * a - b * b;
            let covariance = self.product[i] - a * b;
            let (a, b) = (a + CENTRE, b + CENTRE);
            let luminance = (2.0 * a * b + C1) / (a * a + b * b + C1);
            f64::from(luminance * ((2.0 * covariance + C2) / (variances + C2)))
        };
        (0..self.a.len()).map(one).sum()
    }
}

fn window() -> [f32; WINDOW] {
    let taps: [f64; WINDOW] = std::array::from_fn(|k| {
        let x = k as f64 - (WINDOW / 2) as f64;
        (-x * x / (2.0 * SIGMA * SIGMA)).exp()
    });
    let sum: f64 = taps.iter().sum();
    taps.map(|t| (t / sum) as f32)
}

fn byte_values() -> [f32; 256] {
    std::array::from_fn(|v| v as f32 / 255.0 - CENTRE)
}

#[cfg(test)]
mod tests {
    use super::super::examples::pair;
    use super::*;

    const TOL: f64 = 2e-6; // f32 eps * 0.25 / C2 per window, signs vary over windows

    fn score(a: &[[u8; 3]], b: &[[u8; 3]], w: usize, h: usize) -> Option<f64> {
        ssim(Rgb8::new(a, w, h), Rgb8::new(b, w, h)).unwrap()
    }

    // skimage.metrics.structural_similarity(a / 255, b / 255, data_range=1, channel_axis=-1, gaussian_weights=True,
    // sigma=1.5, use_sample_covariance=False) of `examples::pair`, scikit-image 0.26.0.
    #[test]
    fn agrees_with_scikit_image() {
        for (w, h, want) in SSIM_CASES {
            let (a, b) = pair(w, h);
            let got = score(&a, &b, w, h).unwrap();
            assert!((got - want).abs() < TOL, "{w}x{h}: {got} against {want}");
        }
    }

    #[test]
    fn equal_images_score_one() {
        let (a, _) = pair(17, 13);
        assert!((score(&a, &a, 17, 13).unwrap() - 1.0).abs() < TOL);
    }

    /// Closed form: without variance only the luminance term is left.
    #[test]
    fn flat_images_keep_the_luminance_term() {
        let (a, b) = ([[51; 3]; 144], [[102; 3]; 144]);
        let want = (2.0 * 0.2 * 0.4 + 1e-4) / (0.04 + 0.16 + 1e-4);
        assert!((score(&a, &b, 12, 12).unwrap() - want).abs() < 1e-4);
    }

    #[test]
    fn image_smaller_than_the_window_has_no_score() {
        let a = [[1; 3]; 110];
        assert_eq!(score(&a, &a, 11, 10), None);
        assert_eq!(score(&a, &a, 10, 11), None);
    }

    const SSIM_CASES: [(usize, usize, f64); 4] =
        [(11, 11, 0.9854802420), (24, 20, 0.9912297484), (31, 47, 0.9920066348), (97, 64, 0.9928102835)];
}
