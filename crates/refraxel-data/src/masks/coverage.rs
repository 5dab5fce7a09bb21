//! What a decoded mask covers, however its file says it: by brightness, by alpha, or by numbers of labels.

use crate::Mask;
use crate::size::Size;
use ::image::{DynamicImage, ImageFormat};
use std::collections::HashSet;
use std::path::Path;

/// How a file says what is covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reading {
    /// White is covered.
    White,
    /// Alpha is.
    Alpha,
    /// All but 0 is: the values are numbers of labels, the largest of which is this one.
    Labels(u16),
}

/// A mask and how its file says it.
pub(crate) struct Coverage {
    pub mask: Mask,
    pub reading: Reading,
}

/// Largest value of a mask that is all dark and yet not black, of 255 or 65535, that is a number of a label; and most values of one that
/// has no white, as labels have few.
const MOST_LABELS: u16 = 31;
/// Values from here on are white, of 255: colour tables of segmenters have 128 and 192 as well.
const LEAST_WHITE: u16 = 193;
/// Alpha from which a pixel is there.
const HALF: u8 = 128;

/// The coverage of the mask that was read from `path`.
///
/// Colours count by their brightest channel. Where alpha varies, it says what is covered. Where nothing is brighter than
/// [`MOST_LABELS`], or nothing is white and there are no more values than that, all but 0 is covered, except in JPEG, whose black is
/// not exact.
pub(crate) fn of_mask(decoded: DynamicImage, path: &Path) -> Coverage {
    let size = [decoded.width(), decoded.height()];
    let is_exact = !matches!(ImageFormat::from_path(path), Ok(ImageFormat::Jpeg));
    if decoded.color().has_alpha() {
        let alpha = alpha_of(&decoded);
        if alpha.iter().any(|a| *a >= HALF) && alpha.iter().any(|a| *a < HALF) {
            return Coverage { mask: mask(size, alpha), reading: Reading::Alpha };
        }
    }
    let values = brightness(decoded);
    let most = values.iter().copied().max().unwrap_or(0);
    let is_deep = most > u16::from(u8::MAX);
    let are_few = || values.iter().collect::<HashSet<_>>().len() <= usize::from(MOST_LABELS);
    let is_dark = most < if is_deep { LEAST_WHITE << 8 } else { LEAST_WHITE };
    // Without any 0, labels of many values cover everything, and greys of a soft mask do not.
    let is_table = || is_dark && values.contains(&0) && are_few();
    if is_exact && ((1..=MOST_LABELS).contains(&most) || most > 0 && is_table()) {
        let covered = values.iter().map(|v| if *v > 0 { u8::MAX } else { 0 }).collect();
        return Coverage { mask: mask(size, covered), reading: Reading::Labels(most) };
    }
    let byte = |v: u16| if is_deep { (v >> 8) as u8 } else { v as u8 };
    Coverage { mask: mask(size, values.into_iter().map(byte).collect()), reading: Reading::White }
}

/// Whether there are colours other than grey, beyond the noise of JPEG.
pub(crate) fn has_colours(decoded: DynamicImage) -> bool {
    const NOISE: u8 = 32;
    decoded.into_rgb8().pixels().any(|p| {
        let [r, g, b] = p.0;
        r.max(g).max(b) - r.min(g).min(b) > NOISE
    })
}

/// The alpha channel as a mask.
pub(crate) fn of_alpha(decoded: DynamicImage) -> Mask {
    mask([decoded.width(), decoded.height()], alpha_of(&decoded))
}

/// Whether a mask of this size covers a picture of another size once it is scaled: both have one shape, to within the pixel that was
/// rounded away where one of them was made from the other.
pub(crate) fn has_shape_of(mask: Size, picture: Size) -> bool {
    /// Sizes that are nearer than this were not made by scaling.
    const LEAST_SCALE: f64 = 1.2;
    let [mw, mh, pw, ph] = [mask.width, mask.height, picture.width, picture.height].map(f64::from);
    let (across, down) = (pw / mw, ph / mh);
    let scale = (across * down).sqrt();
    let off = |picture: f64, mask: f64| {
        if scale > 1.0 { (picture / scale - mask).abs() } else { (picture - mask * scale).abs() }
    };
    let is_rounded = off(pw, mw) < 1.0 && off(ph, mh) < 1.0 && scale.max(1.0 / scale) > LEAST_SCALE;
    is_rounded || (across / down - 1.0).abs() < 0.002
}

fn mask([width, height]: [u32; 2], coverage: Vec<u8>) -> Mask {
    Mask { width, height, coverage }
}

fn alpha_of(decoded: &DynamicImage) -> Vec<u8> {
    match decoded {
        DynamicImage::ImageLumaA8(image) => image.pixels().map(|p| p.0[1]).collect(),
        DynamicImage::ImageRgba8(image) => image.pixels().map(|p| p.0[3]).collect(),
        other => other.to_rgba8().pixels().map(|p| p.0[3]).collect(),
    }
}

/// The brightest channel of each pixel, 0..=255, or 0..=65535 of files with 16 bits.
fn brightness(decoded: DynamicImage) -> Vec<u16> {
    let brightest = |rgb: &[u8; 3]| u16::from(rgb[0].max(rgb[1]).max(rgb[2]));
    match decoded {
        DynamicImage::ImageLuma8(image) => image.into_raw().into_iter().map(u16::from).collect(),
        DynamicImage::ImageLuma16(image) => image.into_raw(),
        deep @ (DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_)) => {
            deep.into_rgb16().pixels().map(|p| p.0[0].max(p.0[1]).max(p.0[2])).collect()
        }
        other => other.into_rgb8().pixels().map(|p| brightest(&p.0)).collect(),
    }
}

impl Mask {
    /// Share of pixels that are mostly white.
    pub fn white_share(&self) -> f64 {
        self.share(|c| c >= HALF)
    }

    /// Share of pixels that are neither black nor white.
    pub(crate) fn grey_share(&self) -> f64 {
        self.share(|c| (64..192).contains(&c))
    }

    fn share(&self, is_counted: impl Fn(u8) -> bool) -> f64 {
        let count = self.coverage.iter().filter(|c| is_counted(**c)).count();
        count as f64 / self.coverage.len().max(1) as f64
    }

    /// The mask with another number of pixels: means where there are fewer, else the nearest.
    pub(crate) fn scaled(&self, [width, height]: [u32; 2]) -> Self {
        if width <= self.width && height <= self.height {
            return self.reduced([width, height]);
        }
        let at = |k: u32, to: u32, from: u32| (u64::from(k) * u64::from(from) / u64::from(to)) as usize;
        let row = |y: u32| {
            let start = at(y, height, self.height) * self.width as usize;
            (0..width).map(move |x| self.coverage[start + at(x, width, self.width)])
        };
        Self { width, height, coverage: (0..height).flat_map(row).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::{GrayImage, ImageBuffer, Luma, RgbImage, Rgba, RgbaImage};

    fn read(image: impl Into<DynamicImage>, name: &str) -> (Vec<u8>, Reading) {
        let Coverage { mask, reading } = of_mask(image.into(), Path::new(name));
        (mask.coverage, reading)
    }

    #[test]
    fn masks_of_ones_and_of_labels_cover_all_but_0() {
        let of = |values: &[u8]| GrayImage::from_raw(values.len() as u32, 1, values.to_vec()).unwrap();
        assert_eq!(read(of(&[0, 1, 1]), "a.png"), (vec![0, 255, 255], Reading::Labels(1)));
        assert_eq!(read(of(&[0, 7, 2]), "a.png"), (vec![0, 255, 255], Reading::Labels(7)));
        assert_eq!(
            read(of(&[0, 50, 100]), "a.png"),
            (vec![0, 255, 255], Reading::Labels(100)),
            "grey labels"
        );
        assert_eq!(
            read(of(&[0, 128, 128]), "a.png"),
            (vec![0, 255, 255], Reading::Labels(128)),
            "a colour table"
        );
        assert_eq!(read(of(&[0, 1, 200]), "a.png"), (vec![0, 1, 200], Reading::White));
        assert_eq!(read(of(&[68, 188, 188]), "a.png"), (vec![68, 188, 188], Reading::White), "a soft mask");
        assert_eq!(read(of(&[0, 0, 0]), "a.png"), (vec![0; 3], Reading::White));
        assert_eq!(read(of(&[0, 3, 2]), "a.jpg"), (vec![0, 3, 2], Reading::White), "noise of JPEG");
        let deep = ImageBuffer::<Luma<u16>, _>::from_raw(3, 1, vec![0_u16, 1, 2]).unwrap();
        assert_eq!(read(deep, "a.png"), (vec![0, 255, 255], Reading::Labels(2)));
        let deep = ImageBuffer::<Luma<u16>, _>::from_raw(2, 1, vec![0_u16, 65535]).unwrap();
        assert_eq!(read(deep, "a.png"), (vec![0, 255], Reading::White));
    }

    #[test]
    fn colours_count_by_their_brightest_channel_and_alpha_where_it_varies() {
        let red = RgbImage::from_raw(2, 1, vec![255, 0, 0, 0, 0, 0]).unwrap();
        assert_eq!(read(red, "a.png"), (vec![255, 0], Reading::White));
        let cut = RgbaImage::from_fn(2, 1, |x, _| Rgba([10, 20, 30, if x == 0 { 255 } else { 0 }]));
        assert_eq!(read(cut, "a.png"), (vec![255, 0], Reading::Alpha));
        let opaque =
            RgbaImage::from_fn(2, 1, |x, _| if x == 0 { Rgba([255; 4]) } else { Rgba([0, 0, 0, 255]) });
        assert_eq!(read(opaque, "a.png"), (vec![255, 0], Reading::White));
    }

    #[test]
    fn masks_are_scaled_where_only_rounding_parts_their_shapes() {
        let size = |width, height| Size { width, height };
        for (mask, picture) in
            [((504, 378), (4032, 3024)), ((12, 8), (25, 17)), ((1500, 1000), (1000, 667)), ((2, 2), (4, 4))]
        {
            assert!(has_shape_of(size(mask.0, mask.1), size(picture.0, picture.1)), "{mask:?} {picture:?}");
        }
        for (mask, picture) in
            [((24, 17), (24, 16)), ((5, 3), (4, 3)), ((16, 24), (24, 16)), ((8, 16), (16, 16))]
        {
            assert!(!has_shape_of(size(mask.0, mask.1), size(picture.0, picture.1)), "{mask:?} {picture:?}");
        }
        let small = Mask { width: 2, height: 1, coverage: vec![0, 255] };
        assert_eq!(small.scaled([4, 2]).coverage, [0, 0, 255, 255, 0, 0, 255, 255]);
        assert_eq!(small.scaled([4, 2]).scaled([2, 1]), small);
    }
}
