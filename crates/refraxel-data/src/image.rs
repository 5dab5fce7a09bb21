//! Decoded images: colour with optional alpha, and single-channel masks.

use crate::MaskMeaning;

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

/// Values of colours, encoded as sRGB with 1 = white: filters of renderers leave a little below 0, the sun stands far
/// above white.
const COLOUR: [f32; 2] = [-1.0, 1000.0];
/// Values of alpha: half precision rounds.
const ALPHA: [f32; 2] = [-0.01, 1.01];

/// A pixel with a value that is no colour.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "pixel (column {column}, row {row}) has the {name} {value}; expected {low} to {high}",
    name = if *is_alpha { "alpha" } else { "colour value" },
    low = self.range()[0],
    high = self.range()[1]
)]
pub struct BadPixel {
    /// Column from the left.
    pub column: u32,
    /// Row from the top.
    pub row: u32,
    /// The value is that of alpha, not of a colour.
    pub is_alpha: bool,
    /// The value, sRGB-encoded with 1 = white.
    pub value: f32,
}

impl BadPixel {
    fn range(&self) -> [f32; 2] {
        if self.is_alpha { ALPHA } else { COLOUR }
    }
}

/// The first value of an image of `width` columns and `channels` interleaved channels that is no colour.
pub(crate) fn bad_pixel(values: &[f32], width: u32, channels: u32) -> Option<BadPixel> {
    let (channels, width) = (channels as usize, width as usize);
    let is_alpha = |at: usize| at % channels == 3;
    let is_bad = |(at, v): (usize, &f32)| {
        let [low, high] = if is_alpha(at) { ALPHA } else { COLOUR };
        !(low..=high).contains(v)
    };
    let at = values.iter().enumerate().position(is_bad)?;
    let (column, row) = ((at / channels % width) as u32, (at / channels / width) as u32);
    Some(BadPixel { column, row, is_alpha: is_alpha(at), value: values[at] })
}

/// Whether a pixel of a mask of this coverage is white.
#[inline]
pub fn is_white(coverage: u8) -> bool {
    coverage > 127
}

impl MaskMeaning {
    /// Whether a pixel of this coverage counts.
    pub fn lets_count(self, coverage: u8) -> bool {
        match self {
            Self::Refractive => true,
            Self::Keep => is_white(coverage),
            Self::Ignore => !is_white(coverage),
        }
    }
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
