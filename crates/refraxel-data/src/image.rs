//! Decoded images: colour with optional alpha, and single-channel masks.

/// Channel values of an image, in the precision of its file.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// 0..=255, sRGB-encoded.
    U8(Vec<u8>),
    /// 1.0 = white, sRGB-encoded (16-bit PNG, EXR after encoding).
    F32(Vec<f32>),
}

/// An image of 3 (RGB) or 4 (RGB + straight alpha) interleaved channels, rows from the top: the shape is
/// (height, width, channels), and channels run fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width [pixel].
    pub width: u32,
    /// Height [pixel].
    pub height: u32,
    /// 3 or 4.
    pub channels: u32,
    /// `height * width * channels` values.
    pub pixels: Pixels,
}

impl Image {
    /// Colour and alpha (1 where the image has none) of pixel `index = row * width + column`.
    #[inline]
    pub fn rgba(&self, index: usize) -> [f32; 4] {
        let c = self.channels as usize;
        let at = |k: usize| match &self.pixels {
            Pixels::U8(v) => f32::from(v[index * c + k]) / 255.0,
            Pixels::F32(v) => v[index * c + k],
        };
        [at(0), at(1), at(2), if c == 4 { at(3) } else { 1.0 }]
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// True for an image without pixels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A pixel whose value is NaN or infinite.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BadPixel {
    /// Column from the left.
    pub column: u32,
    /// Row from the top.
    pub row: u32,
    /// NaN, inf or -inf.
    pub value: f32,
}

/// The first pixel of an image of `width` columns and `channels` interleaved channels that has such a value.
pub(crate) fn not_finite(values: &[f32], width: u32, channels: u32) -> Option<BadPixel> {
    let at = values.iter().position(|v| !v.is_finite())?;
    let (pixel, width) = (at / channels as usize, width as usize);
    Some(BadPixel { column: (pixel % width) as u32, row: (pixel / width) as u32, value: values[at] })
}

/// A coverage mask, 0..=255, rows from the top: the shape is (height, width), and columns run fastest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// Width [pixel].
    pub width: u32,
    /// Height [pixel].
    pub height: u32,
    /// `height * width` coverages; 255 = white.
    pub coverage: Vec<u8>,
}
