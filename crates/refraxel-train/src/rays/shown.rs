//! What rays of a batch show, and how far that is from what they should show.

use super::batch::Batch;
use refraxel_core::radiance::Pixel;

/// A transparent pixel before something.
pub fn over([r, g, b, alpha]: [f32; 4], behind: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|c| [r, g, b][c] * alpha + behind[c] * (1.0 - alpha))
}

/// The colour C of each ray of a batch, from what rays show over the model's own background. Where a batch brings its own
/// radiance behind the field, the model's is white.
pub fn shown(pixels: &[Pixel<f32>], batch: &Batch) -> Vec<[f32; 3]> {
    let colour = |(ray, pixel): (usize, &Pixel<f32>)| {
        let behind: [f32; 3] = batch.behind.get(ray).map_or([0.0; 3], |b| [0, 1, 2].map(|c| b[c] - WHITE[c]));
        [0, 1, 2].map(|c| pixel.colour[c] + pixel.transmittance * behind[c])
    };
    pixels.iter().enumerate().map(colour).collect()
}

/// |C − target|² of each ray of a batch, from what rays [show](shown).
pub fn squared_errors(pixels: &[Pixel<f32>], batch: &Batch) -> Vec<f64> {
    let error = |(colour, target): ([f32; 3], &[f32; 3])| {
        (0..3).map(|c| f64::from(colour[c] - target[c]).powi(2)).sum()
    };
    shown(pixels, batch).into_iter().zip(&batch.target).map(error).collect()
}

/// The colour behind transparent pictures in renderings and scores.
pub const WHITE: [f32; 3] = [1.0; 3];
