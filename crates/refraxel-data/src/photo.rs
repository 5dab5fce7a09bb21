//! The pixels of views: colour, alpha and masks of their files, turned, cut and reduced as the view asks.

use crate::decoding::{self, Decoded, Header, turned};
use crate::image::bad_pixel;
use crate::masks::coverage;
use crate::orientation::Orientation;
use crate::quantize::quantize;
use crate::reduce::size_of;
use crate::size::Size;
use crate::{AlphaUse, DataError, Dataset, Image, Mask, Photo, PhotoSource, Pixels, Stored, View, depth};
use ::image::DynamicImage;
use ::image::metadata::Orientation as Turn;
use rayon::prelude::*;
use refraxel_core::Real;
use std::path::Path;
use std::sync::Arc;

/// The pixels of a view: those in memory as they are, shared, or those of its files, decoded.
///
/// EXR is linear and premultiplied by definition; it is divided by its alpha and sRGB-encoded.
pub fn load_photo(view: &View) -> Result<Photo, DataError> {
    let (path, stored, orientation, alpha) = match &view.source {
        PhotoSource::Memory(photo) => return Ok(photo.clone()),
        PhotoSource::Files { image, stored, orientation, alpha, .. } => {
            (image, *stored, *orientation, *alpha)
        }
    };
    let expected = stored_size(view);
    let Decoded { header, mut image, room } = decoding::decode(path)?;
    if orientation == Orientation::Upright {
        image.apply_orientation(header.orientation);
    }
    let found = Size { width: image.width(), height: image.height() };
    if found != expected {
        return Err(DataError::ImageSize { path: path.clone(), found, expected });
    }
    let depth = view.depth.as_ref().map(depth::load).transpose()?;
    let photo = Photo { depth, ..Photo::new(with_alpha_used(to_image(path, image)?, alpha), None) };
    let photo = as_seen(view, stored, photo);
    drop(room); // masks need some of their own
    Ok(Photo { mask: load_mask_of(view)?, ..photo })
}

/// What a view shows of the photo of its whole file.
fn as_seen(view: &View, stored: Option<Stored>, photo: Photo) -> Photo {
    let Some(Stored { crop, .. }) = stored else { return photo };
    let photo = if crop.is_none() { photo } else { photo.cropped(crop) };
    let size = size_of(&view.camera);
    if [photo.image.width, photo.image.height] == size { photo } else { photo.reduced(size) }
}

/// What a view shows of its whole mask.
fn mask_as_seen(view: &View, stored: Option<Stored>, mask: Mask) -> Mask {
    let Some(Stored { crop, .. }) = stored else { return mask };
    let mask = if crop.is_none() { mask } else { mask.cropped(crop) };
    let size = size_of(&view.camera);
    if [mask.width, mask.height] == size { mask } else { mask.reduced(size) }
}

/// The size of the files of a view.
pub(crate) fn stored_size(view: &View) -> Size {
    let stored = match &view.source {
        PhotoSource::Files { stored, .. } => *stored,
        PhotoSource::Memory(_) => None,
    };
    let [width, height] = stored.map_or(size_of(&view.camera), |s| s.size);
    Size { width, height }
}

/// The mask of a view as [`load_photo`] gives it, without the pixels of the image.
pub fn load_mask_of(view: &View) -> Result<Option<Arc<Mask>>, DataError> {
    match &view.source {
        PhotoSource::Memory(photo) => Ok(photo.mask.clone()),
        PhotoSource::Files { mask: None, .. } => Ok(None),
        PhotoSource::Files { image, mask: Some(mask), stored, orientation, .. } => {
            let mask = load_mask(mask, image, *orientation, stored_size(view))?;
            Ok(Some(Arc::new(mask_as_seen(view, *stored, mask))))
        }
    }
}

impl Dataset {
    /// Loads the photos of the views `indices` on all threads, in the order given. `on_loaded` is called with each index
    /// when its photo is there.
    ///
    /// # Panics
    /// When an index is not one of [`Dataset::views`].
    pub fn load_photos(
        &self,
        indices: &[usize],
        on_loaded: impl Fn(usize) + Sync,
    ) -> Result<Vec<Photo>, DataError> {
        let load = |&index: &usize| {
            let photo = load_photo(&self.views[index])?;
            on_loaded(index);
            Ok(photo)
        };
        indices.par_iter().map(load).collect()
    }
}

/// Whether a mask covers its image only after it is scaled, from the headers.
///
/// Errors: it has another shape.
pub(crate) fn is_scaled(
    mask: &Path,
    image: &Path,
    orientation: Orientation,
    expected: Size,
) -> Result<bool, DataError> {
    let header = decoding::header(mask)?;
    let turn = mask_turn(mask, &header, image, orientation, expected)?;
    Ok(turned(header.stored, turn) != expected)
}

/// Whether a mask without a tag of its own has the shape of its image both as that is stored and as its tag turns it.
pub(crate) fn may_be_turned(mask: &Path, image: &Path) -> Result<bool, DataError> {
    let (mask, image) = (decoding::header(mask)?, decoding::header(image)?);
    Ok(image.turned() && !mask.turned() && coverage::has_shape_of(image.stored, image.upright()))
}

/// The mask of an image whose pixels are `expected` in size where they are oriented so: the alpha channel where the mask is the
/// image itself.
pub(crate) fn load_mask(
    path: &Path,
    image: &Path,
    orientation: Orientation,
    expected: Size,
) -> Result<Mask, DataError> {
    let Decoded { header, image: mut mask, room: _room } = decoding::decode(path)?;
    mask.apply_orientation(mask_turn(path, &header, image, orientation, expected)?);
    let mask = if path == image { coverage::of_alpha(mask) } else { coverage::of_mask(mask, path).mask };
    let size = [expected.width, expected.height];
    Ok(if [mask.width, mask.height] == size { mask } else { mask.scaled(size) })
}

/// How the stored pixels of a mask are turned to those of its image. A mask without a tag of its own is made from the pixels
/// that are meant; where it has not their shape, from those that the image has in the other orientation.
fn mask_turn(
    path: &Path,
    mask: &Header,
    image: &Path,
    orientation: Orientation,
    expected: Size,
) -> Result<Turn, DataError> {
    let own = match orientation {
        Orientation::Stored => Turn::NoTransforms,
        Orientation::Upright => mask.orientation,
    };
    let same = |turn: Turn| turned(mask.stored, turn) == expected;
    let scaled = |turn: Turn| coverage::has_shape_of(turned(mask.stored, turn), expected);
    if let Some(turn) = [own, Turn::NoTransforms].into_iter().find(|turn| same(*turn)) {
        return Ok(turn);
    }
    let photograph = decoding::header(image)?.orientation;
    let other = match orientation {
        Orientation::Stored => inverse(photograph),
        Orientation::Upright => photograph,
    };
    let all = [own, Turn::NoTransforms, other];
    let found =
        all.into_iter().find(|turn| same(*turn)).or_else(|| all.into_iter().find(|turn| scaled(*turn)));
    found.ok_or_else(|| DataError::MaskSize {
        path: path.to_owned(),
        mask: mask.stored,
        image: image.to_owned(),
        expected,
    })
}

/// How the coverage of a mask's file is stored.
pub(crate) fn mask_reading(path: &Path) -> Result<coverage::Reading, DataError> {
    Ok(coverage::of_mask(decoding::decode(path)?.image, path).reading)
}

/// Whether a mask's file is in colour.
pub(crate) fn mask_has_colours(mask: &Path) -> Result<bool, DataError> {
    Ok(coverage::has_colours(decoding::decode(mask)?.image))
}

/// Share of a mask's pixels that are mostly white.
pub(crate) fn white_share(mask: &Path) -> Result<f64, DataError> {
    Ok(coverage::of_mask(decoding::decode(mask)?.image, mask).mask.white_share())
}

fn inverse(turn: Turn) -> Turn {
    match turn {
        Turn::Rotate90 => Turn::Rotate270,
        Turn::Rotate270 => Turn::Rotate90,
        itself => itself,
    }
}

/// The image with its alpha channel as that is used.
fn with_alpha_used(image: Image, alpha: AlphaUse) -> Image {
    let behind = match alpha {
        AlphaUse::LeftOut => None,
        AlphaUse::Over(colour) => Some(colour),
        AlphaUse::Kept => return image,
    };
    if image.channels < 4 {
        return image;
    }
    let colour = |pixel: usize| {
        let [r, g, b, a] = image.rgba(pixel);
        behind.map_or([r, g, b], |behind| [0, 1, 2].map(|c| [r, g, b][c] * a + behind[c] * (1.0 - a)))
    };
    let values = (0..image.len()).flat_map(colour);
    let pixels = match image.pixels {
        Pixels::U8(_) => Pixels::U8(values.map(quantize).collect()),
        Pixels::F32(_) => Pixels::F32(values.collect()),
    };
    Image { channels: 3, pixels, ..image }
}

fn to_image(path: &Path, decoded: DynamicImage) -> Result<Image, DataError> {
    let (width, height, alpha) = (decoded.width(), decoded.height(), decoded.color().has_alpha());
    let channels = if alpha { 4 } else { 3 };
    let pixels = match decoded.color().bytes_per_pixel() / decoded.color().channel_count() {
        1 if alpha => Pixels::U8(decoded.into_rgba8().into_raw()),
        1 => Pixels::U8(decoded.into_rgb8().into_raw()),
        2 if alpha => Pixels::F32(decoded.into_rgba32f().into_raw()),
        2 => Pixels::F32(decoded.into_rgb32f().into_raw()),
        _ if alpha => Pixels::F32(encode_linear(4, decoded.into_rgba32f().into_raw())),
        _ => Pixels::F32(encode_linear(3, decoded.into_rgb32f().into_raw())),
    };
    if let Pixels::F32(values) = &pixels
        && let Some(pixel) = bad_pixel(values, width, channels)
    {
        return Err(DataError::Pixel { path: path.to_owned(), pixel });
    }
    Ok(Image { width, height, channels, pixels })
}

/// Linear, premultiplied EXR values to straight alpha and sRGB.
fn encode_linear(channels: usize, mut values: Vec<f32>) -> Vec<f32> {
    for pixel in values.chunks_exact_mut(channels) {
        let alpha = pixel.get(3).copied().unwrap_or(1.0);
        for c in &mut pixel[..3] {
            *c = srgb_encode(if alpha > 0.0 { *c / alpha } else { *c });
        }
    }
    values
}

/// sRGB transfer function (IEC 61966-2-1), continued beyond 1 for high dynamic range.
pub(crate) fn srgb_encode<T: Real>(linear: T) -> T {
    if linear <= T::of(0.003_130_8) {
        T::of(12.92) * linear
    } else {
        T::of(1.055) * linear.powf(T::of(2.4).recip()) - T::of(0.055)
    }
}

/// Light of an sRGB code ≥ 0 (IEC 61966-2-1), 1 = white for both.
pub fn srgb_decode<T: Real>(code: T) -> T {
    if code <= T::of(0.04045) {
        code / T::of(12.92)
    } else {
        ((code + T::of(0.055)) / T::of(1.055)).powf(T::of(2.4))
    }
}
