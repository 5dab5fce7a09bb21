//! What is measured of one photograph.

use crate::verbs::detail::detail;
use image::GrayImage;
use refraxel_data::{Backdrop, Mask, MaskMeaning, Photo, Reduction, View};
use refraxel_train::evaluation::truth;
use refraxel_train::rays;

/// Photographs are measured with edges of at most so many pixels: single pixels of large ones show noise.
const LONGEST: u32 = 1600;
/// By how much the scales that sharpness compares differ.
const OCTAVES: u32 = 4;
/// Share of the variance in the coarse detail: something blurred beyond the coarse scale is not sharp.
const CONTRAST: f64 = 0.1;
/// Smaller pictures have no coarse scale [pixel].
const LEAST: u32 = 4 * OCTAVES;
/// Levels of 255 up to which a pixel is black, and from which on it is white.
const BLACK: u8 = 3;
const WHITE: u8 = 253;
/// A pixel that differs from the backdrop by no more shows the backdrop.
const BACKDROP: f32 = 2.0 / 255.0;
/// Rows and columns of a signature.
const SIGNATURE: u32 = 32;

/// The numbers of one photograph, over the pixels that are used: those that a mask leaves out, and a backdrop of
/// one colour, do not count.
#[derive(Clone, Debug, Default)]
pub struct Measures {
    /// Mean luma, 1 = white; `None` where no pixel is used.
    pub brightness: Option<f64>,
    /// Shares of pixels that are black, and white.
    pub black: f64,
    pub white: f64,
    /// Standard deviation of the luma [level of 255].
    pub contrast: f64,
    /// Detail of the finest scale as a part of that of a coarser one, about 0.4 to 1 where focus was right; `None`
    /// for tiny pictures.
    pub sharpness: Option<f64>,
    /// The mask, where there is one.
    pub mask: Option<MaskMeasures>,
    /// Luma of the areas of a grid.
    pub signature: Vec<u8>,
}

/// The numbers of one mask.
#[derive(Clone, Copy, Debug)]
pub struct MaskMeasures {
    /// Share of the picture that is white.
    pub white: f64,
    /// Share of its border, all around, that is white.
    pub white_border: f64,
}

/// The photograph as it is measured: with fewer pixels by a whole factor, which is the same for all of a size.
pub fn reduced(photo: Photo) -> Photo {
    let size = [photo.image.width, photo.image.height];
    let divisor = size[0].max(size[1]).div_ceil(LONGEST);
    if divisor > 1 { photo.reduced(Reduction::Divide(divisor).size(size)) } else { photo }
}

/// Measures a [reduced] photograph.
pub fn measure(photo: &Photo, view: &View, backdrop: Backdrop) -> Measures {
    let (width, height) = (photo.image.width, photo.image.height);
    let levels: Vec<u8> = truth(photo, backdrop).into_iter().map(luma).collect();
    let used: Vec<f64> = (0..levels.len())
        .filter(|&p| is_used(photo, view.mask_meaning, backdrop, p))
        .map(|p| f64::from(levels[p]))
        .collect();
    let share =
        |is: &dyn Fn(f64) -> bool| used.iter().filter(|v| is(**v)).count() as f64 / used.len().max(1) as f64;
    let signature = areas(&levels, [width, height], [SIGNATURE.min(width), SIGNATURE.min(height)]);
    let (black, white) = (share(&|v| v <= f64::from(BLACK)), share(&|v| v >= f64::from(WHITE)));
    Measures {
        brightness: (!used.is_empty()).then(|| mean(&used) / 255.0),
        black,
        white,
        contrast: variance(&used).sqrt(),
        sharpness: GrayImage::from_raw(width, height, levels).and_then(sharpness),
        mask: photo.mask.as_deref().map(measure_mask),
        signature,
    }
}

/// Rec. 709.
fn luma([r, g, b]: [u8; 3]) -> u8 {
    (0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)).round() as u8
}

fn is_used(photo: &Photo, meaning: MaskMeaning, backdrop: Backdrop, pixel: usize) -> bool {
    let is_kept = rays::is_used(photo, meaning, pixel);
    let [r, g, b, alpha] = photo.image.rgba(pixel);
    let is_scene = match backdrop {
        Backdrop::Transparent => alpha > 0.5,
        Backdrop::Color(c) => [r, g, b].iter().zip(c).any(|(v, c)| (v - c).abs() > BACKDROP),
        Backdrop::Surroundings => true,
    };
    is_kept && is_scene
}

fn sharpness(fine: GrayImage) -> Option<f64> {
    let size = [fine.width(), fine.height()];
    if size[0].min(size[1]) < LEAST {
        return None;
    }
    let [width, height] = size.map(|n| n / OCTAVES);
    let coarse = GrayImage::from_raw(width, height, areas(fine.as_raw(), size, [width, height]))?;
    let levels: Vec<f64> = coarse.as_raw().iter().map(|v| f64::from(*v)).collect();
    // The last is the detail of rounding to whole levels, at most.
    Some((detail(&fine) / (detail(&coarse) + CONTRAST * variance(&levels) + 1.0)).sqrt())
}

/// Means over a grid of areas, each of whole pixels.
fn areas(levels: &[u8], [width, height]: [u32; 2], [across, down]: [u32; 2]) -> Vec<u8> {
    let edge = |k: u32, from: u32, to: u32| (u64::from(k) * u64::from(from) / u64::from(to)) as usize;
    let area = |x: u32, y: u32| {
        let (columns, mut sum, mut count) = (edge(x, width, across)..edge(x + 1, width, across), 0, 0);
        for row in edge(y, height, down)..edge(y + 1, height, down) {
            let line = &levels[row * width as usize..][columns.clone()];
            sum += line.iter().map(|v| u64::from(*v)).sum::<u64>();
            count += line.len() as u64;
        }
        ((sum + count / 2) / count.max(1)) as u8
    };
    (0..down).flat_map(|y| (0..across).map(move |x| (x, y))).map(|(x, y)| area(x, y)).collect()
}

fn measure_mask(mask: &Mask) -> MaskMeasures {
    let (width, height) = (mask.width as usize, mask.height as usize);
    let rows = (0..width).flat_map(|x| [x, (height - 1) * width + x]);
    let columns = (0..height).flat_map(|y| [y * width, y * width + width - 1]);
    let border = Mask { coverage: rows.chain(columns).map(|p| mask.coverage[p]).collect(), ..*mask };
    MaskMeasures { white: mask.white_share(), white_border: border.white_share() }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Camera, Vec3, vec3};
    use refraxel_data::{Image, Pixels};

    fn grey(levels: &GrayImage, mask: Option<Mask>) -> Photo {
        let pixels = Pixels::U8(levels.as_raw().iter().flat_map(|v| [*v; 3]).collect());
        Photo::new(Image { width: levels.width(), height: levels.height(), channels: 3, pixels }, mask)
    }

    fn view() -> View {
        let camera = Camera::look_at(vec3(3.0, 0.0, 0.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.8, [64, 48]);
        View::of_file("a.png", camera)
    }

    fn squares() -> GrayImage {
        let dark = |x: u32, y: u32| (x / 5 + y / 7).is_multiple_of(2) != (x / 17).is_multiple_of(2);
        GrayImage::from_fn(64, 48, |x, y| image::Luma([if dark(x, y) { 40 } else { 190 }]))
    }

    fn sharpness_of(levels: &GrayImage) -> f64 {
        measure(&grey(levels, None), &view(), Backdrop::Surroundings).sharpness.unwrap()
    }

    #[test]
    fn any_blur_lowers_sharpness_and_contrast_alone_does_not() {
        let whole = sharpness_of(&squares());
        for sigma in [1.0, 2.0, 6.0, 20.0] {
            let blurred = sharpness_of(&image::imageops::blur(&squares(), sigma));
            assert!(blurred < 0.6 * whole, "{sigma}: {blurred} of {whole}");
        }
        let faint = GrayImage::from_fn(64, 48, |x, y| image::Luma([squares().get_pixel(x, y)[0] / 2 + 60]));
        assert!((sharpness_of(&faint) / whole - 1.0).abs() < 0.05);
    }

    #[test]
    fn what_is_not_used_does_not_count() {
        let levels = GrayImage::from_fn(64, 48, |x, _| image::Luma([if x < 16 { 100 } else { 255 }]));
        let coverage = (0..64 * 48).map(|p| if p % 64 < 16 { 255 } else { 0 }).collect();
        let photo = grey(&levels, Some(Mask { width: 64, height: 48, coverage }));
        let kept = measure(&photo, &view(), Backdrop::Surroundings);
        assert_eq!((kept.brightness, kept.white), (Some(100.0 / 255.0), 0.0));
        let mask = kept.mask.unwrap();
        assert!((mask.white - 0.25).abs() < 1e-9 && mask.white_border > 0.25, "{mask:?}");
        let backdrop = measure(&grey(&levels, None), &view(), Backdrop::Color([1.0; 3]));
        assert_eq!(backdrop.brightness, Some(100.0 / 255.0));
        let all = measure(&grey(&levels, None), &view(), Backdrop::Surroundings);
        assert_eq!((all.white, all.black), (0.75, 0.0));
    }

    #[test]
    fn tiny_pictures_have_brightness_and_no_sharpness() {
        let tiny = measure(&grey(&GrayImage::new(3, 2), None), &view(), Backdrop::Surroundings);
        assert_eq!((tiny.brightness, tiny.black, tiny.sharpness), (Some(0.0), 1.0, None));
        assert_eq!(tiny.signature, [0; 6]);
    }
}
