//! Images that are scored.

use super::error::MetricsError;

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

    pub(super) fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }
}

pub(super) fn same_size(render: Rgb8<'_>, truth: Rgb8<'_>) -> Result<(), MetricsError> {
    if render.size() == truth.size() {
        return Ok(());
    }
    Err(MetricsError::ImageSize { render: render.size(), truth: truth.size() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[should_panic(expected = "2x2 image")]
    fn image_with_missing_pixels_is_refused() {
        let _ = Rgb8::new(&[[0; 3]; 3], 2, 2);
    }
}
