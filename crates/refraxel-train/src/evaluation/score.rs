//! Renderings against their photographs: the one protocol behind training curves, `eval` and `compare`.

use super::Rendering;
use crate::metrics::{ImageScore, MetricsError, Rgb8};
use refraxel_data::{Backdrop, MaskMeaning, Photo, View, quantize};

/// The truth as 8-bit colour; alpha is composited on white.
pub fn truth(photo: &Photo, backdrop: Backdrop) -> Vec<[u8; 3]> {
    (0..photo.image.len())
        .map(|p| {
            let [r, g, b, alpha] = photo.image.rgba(p);
            let alpha = if backdrop == Backdrop::Transparent { alpha } else { 1.0 };
            [r, g, b].map(|c| quantize(c * alpha + 1.0 - alpha))
        })
        .collect()
}

/// A checksum of truth images in their order, so that scores of different images are not compared.
#[derive(Clone, Debug, Default)]
pub struct TruthChecksum(crc32fast::Hasher);

impl TruthChecksum {
    /// Takes the next image into account.
    pub fn add(&mut self, truth: &[[u8; 3]]) {
        self.0.update(&(truth.len() as u64).to_le_bytes());
        self.0.update(truth.as_flattened());
    }

    /// Eight hexadecimal digits.
    pub fn text(self) -> String {
        format!("{:08x}", self.0.finalize())
    }
}

/// Score a rendering against its photograph. Refractive masks give the scores inside and outside; other masks none.
pub fn score(
    rendering: &Rendering,
    view: &View,
    photo: &Photo,
    backdrop: Backdrop,
) -> Result<ImageScore, MetricsError> {
    let expected = truth(photo, backdrop);
    let rendered = Rgb8::new(&rendering.colour, rendering.width as usize, rendering.height as usize);
    let truth = Rgb8::new(&expected, photo.image.width as usize, photo.image.height as usize);
    let refractive = view.mask_meaning == MaskMeaning::Refractive;
    let mask = photo.mask.as_ref().filter(|_| refractive).map(|m| &m.coverage[..]);
    ImageScore::new(&view.name, rendered, truth, mask)
}
