//! Image quality in one named protocol: both images in 8-bit sRGB, one figure per image, then the mean over images.

mod psnr;
mod scores;
mod ssim;

pub use psnr::{masked_psnr, psnr};
pub use scores::{ImageScore, Scores};
pub use ssim::ssim;

/// Names the protocol of every figure of this module; printed and stored next to the figures.
///
/// PSNR from the mean squared error of 8-bit values / 255, SSIM with an 11×11 Gaussian window of σ 1.5 over the places
/// where the window fits, masked PSNR over the pixels of the mask only; each per image, then the mean over images.
pub const PROTOCOL: &str = "srgb8-mean; ssim 11x11 gaussian 1.5 valid";

/// An 8-bit sRGB image to be scored; pixels row by row from the top.
#[derive(Clone, Copy, Debug)]
pub struct Rgb8<'a> {
    pixels: &'a [[u8; 3]],
    width: usize,
    height: usize,
}

impl<'a> Rgb8<'a> {
    /// Views `pixels`, `height` rows of `width`.
    ///
    /// # Panics
    /// When there are no pixels, or not `width * height` of them.
    pub fn new(pixels: &'a [[u8; 3]], width: usize, height: usize) -> Self {
        assert!(!pixels.is_empty(), "an image to be scored has pixels");
        assert_eq!(pixels.len(), width * height, "a {width}x{height} image has {} pixels", pixels.len());
        Self { pixels, width, height }
    }

    /// Pixels, rows from the top.
    pub fn pixels(&self) -> &'a [[u8; 3]] {
        self.pixels
    }

    /// Width [pixel].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height [pixel].
    pub fn height(&self) -> usize {
        self.height
    }

    fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }
}

/// The two images of one comparison do not match.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MetricsError {
    /// Render and truth differ in size.
    #[error("the render is {}x{} but the truth is {}x{} pixels: render the truth's camera at full size",
        render.0, render.1, truth.0, truth.1)]
    ImageSize {
        /// Width and height of the render [pixel].
        render: (usize, usize),
        /// Width and height of the truth [pixel].
        truth: (usize, usize),
    },
    /// The mask has another number of pixels than the truth.
    #[error("the mask has {mask} pixels but the image has {image}: a mask has the size of its image")]
    MaskSize {
        /// Pixels of the mask.
        mask: usize,
        /// Pixels of the image.
        image: usize,
    },
}

fn same_size(render: Rgb8<'_>, truth: Rgb8<'_>) -> Result<(), MetricsError> {
    if render.size() == truth.size() {
        return Ok(());
    }
    Err(MetricsError::ImageSize { render: render.size(), truth: truth.size() })
}

/// Nearest 8-bit value of an sRGB-encoded channel, theory (5.1): 0 → 0, 1 → 255; outside is clamped, NaN becomes 0.
///
/// Rounds to nearest; truncation would cost up to 1.5 dB at 49 dB.
#[inline]
pub fn quantize(channel: f32) -> u8 {
    (channel * 255.0).round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
pub(crate) mod examples {
    //! Image pairs defined by a formula, so that other programs can build the same ones.

    /// `height * width` pixels: a smooth wave with edges in it, and the same with errors of a few grey levels.
    pub fn pair(width: usize, height: usize) -> (Vec<[u8; 3]>, Vec<[u8; 3]>) {
        let at = |i: usize, c: usize| {
            let (x, y) = (i % width, i / width);
            let base = (x * x + 3 * y * (c + 1) + 40 * ((x / 5 + y / 4) % 3)) % 200;
            let error = (7 * x + 11 * y + 5 * c + x * y) % 23;
            (base as u8 + 20, (base + 9 + error) as u8)
        };
        let image = |pick: fn((u8, u8)) -> u8| {
            (0..width * height).map(|i| [0, 1, 2].map(|c| pick(at(i, c)))).collect()
        };
        (image(|p| p.0), image(|p| p.1))
    }

    /// A disc of coverage 255 around the image's centre, half covered pixels at its rim.
    pub fn disc(width: usize, height: usize) -> Vec<u8> {
        let r2 = (width.min(height) / 3).pow(2);
        (0..width * height)
            .map(|i| {
                let d2 = (i % width).abs_diff(width / 2).pow(2) + (i / width).abs_diff(height / 2).pow(2);
                if d2 < r2 { 255 } else { 127 * u8::from(d2 == r2) }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantize_rounds_to_nearest_and_clamps() {
        let cases =
            [(0.0, 0), (1.0, 255), (0.5, 128), (-0.1, 0), (1.5, 255), (0.49 / 255.0, 0), (0.51 / 255.0, 1)];
        for (channel, byte) in cases {
            assert_eq!(quantize(channel), byte, "{channel}");
        }
        assert_eq!(quantize(f32::NAN), 0);
    }

    #[test]
    fn quantize_inverts_division_by_255() {
        for byte in 0..=255u8 {
            assert_eq!(quantize(f32::from(byte) / 255.0), byte);
        }
    }

    #[test]
    #[should_panic(expected = "2x2 image")]
    fn image_with_missing_pixels_is_refused() {
        let _ = Rgb8::new(&[[0; 3]; 3], 2, 2);
    }
}
