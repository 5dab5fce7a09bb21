//! The surface itself: its pixels, rectangles and pictures on it, and PNG.

use std::io;
use std::path::Path;

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use refraxel_data::atomic::{WriteError, write_atomic};
use refraxel_train::metrics::Rgb8;

/// An 8-bit sRGB colour.
pub type Colour = [u8; 3];

/// A drawing surface; x runs right and y down from the top left corner [pixel].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
}

/// An axis-parallel rectangle [pixel].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// Left edge.
    pub x: usize,
    /// Upper edge.
    pub y: usize,
    /// Extent to the right.
    pub width: usize,
    /// Extent downwards.
    pub height: usize,
}

impl Canvas {
    /// A surface of one colour.
    pub fn new(width: usize, height: usize, background: Colour) -> Self {
        Self { width, height, pixels: vec![background; width * height] }
    }

    /// Width [pixel].
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height [pixel].
    pub fn height(&self) -> usize {
        self.height
    }

    /// Colour of one pixel.
    ///
    /// # Panics
    /// Outside the surface.
    pub fn pixel(&self, x: usize, y: usize) -> Colour {
        assert!(x < self.width, "column {x} of a surface {} wide", self.width);
        self.pixels[y * self.width + x]
    }

    /// Colours of all pixels, rows from the top.
    pub fn pixels(&self) -> &[Colour] {
        &self.pixels
    }

    /// Fills the part of `rect` that lies on the surface.
    pub fn fill(&mut self, rect: Rect, colour: Colour) {
        let right = (rect.x + rect.width).min(self.width);
        for y in rect.y..(rect.y + rect.height).min(self.height) {
            self.pixels[y * self.width..][rect.x.min(right)..right].fill(colour);
        }
    }

    /// Copies an image with its top left corner at (`x`, `y`); what lies outside the surface is dropped.
    pub fn paste(&mut self, x: usize, y: usize, image: Rgb8<'_>) {
        let columns = image.width().min(self.width.saturating_sub(x));
        if columns == 0 {
            return;
        }
        for (k, row) in image.pixels().chunks_exact(image.width()).enumerate() {
            if y + k < self.height {
                self.pixels[(y + k) * self.width + x..][..columns].copy_from_slice(&row[..columns]);
            }
        }
    }

    /// Writes the surface as PNG, atomically.
    pub fn save_png(&self, path: &Path) -> Result<(), WriteError> {
        write_png(path, self.pixels.as_flattened(), [self.width, self.height], ExtendedColorType::Rgb8)
    }

    /// How many pixels have this colour.
    #[cfg(test)]
    pub fn count(&self, colour: Colour) -> usize {
        self.pixels.iter().filter(|p| **p == colour).count()
    }

    /// Mixes `colour` into a pixel, all of it at `opacity` 1; nothing happens outside the surface.
    pub(super) fn mix(&mut self, x: i64, y: i64, colour: Colour, opacity: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else { return };
        if x >= self.width || y >= self.height {
            return;
        }
        let pixel = &mut self.pixels[y * self.width + x];
        for (below, above) in pixel.iter_mut().zip(colour) {
            *below = (f32::from(*below) + (f32::from(above) - f32::from(*below)) * opacity).round() as u8;
        }
    }
}

/// Writes pixels as PNG, atomically; 16-bit samples in the machine's byte order.
pub fn write_png(
    path: &Path,
    pixels: &[u8],
    size: [usize; 2],
    colour: ExtendedColorType,
) -> Result<(), WriteError> {
    let side = |n: usize| u32::try_from(n).map_err(io::Error::other);
    write_atomic(path, |writer| {
        let (width, height) = (side(size[0])?, side(size[1])?);
        let encoder = PngEncoder::new(writer);
        encoder.write_image(pixels, width, height, colour).map_err(io::Error::other)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_data::photographs::stored_pixels;

    #[test]
    fn drawing_outside_the_surface_is_dropped() {
        let mut canvas = Canvas::new(3, 2, [0; 3]);
        canvas.fill(Rect { x: 2, y: 1, width: 9, height: 9 }, [1; 3]);
        canvas.fill(Rect { x: 7, y: 0, width: 1, height: 1 }, [2; 3]);
        canvas.paste(2, 0, Rgb8::new(&[[3; 3]; 4], 2, 2));
        canvas.paste(5, 5, Rgb8::new(&[[4; 3]; 4], 2, 2));
        assert_eq!(canvas.pixels, [[0; 3], [0; 3], [3; 3], [0; 3], [0; 3], [3; 3]]);
    }

    #[test]
    fn png_holds_the_pixels() {
        let mut canvas = Canvas::new(5, 3, [9, 8, 7]);
        canvas.fill(Rect { x: 1, y: 1, width: 2, height: 1 }, [200, 100, 50]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.png");
        canvas.save_png(&path).unwrap();
        let read = stored_pixels(&path).unwrap().into_rgb8();
        assert_eq!(read.as_raw(), canvas.pixels.as_flattened());
    }
}
