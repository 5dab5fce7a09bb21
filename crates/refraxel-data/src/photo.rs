//! Image files to pixels: PNG, JPEG and EXR, colour, alpha and masks.

use crate::image::bad_pixel;
use crate::reduce::size_of;
use crate::size::Size;
use crate::{DataError, Dataset, Image, Mask, Photo, PhotoSource, Pixels, Stored, View, jpeg, limits};
use ::image::codecs::{jpeg::JpegEncoder, png::PngEncoder};
use ::image::metadata::Orientation;
use ::image::{DynamicImage, ImageDecoder, ImageEncoder, ImageError, ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use std::io::{self, BufRead, Cursor, Seek};
use std::path::Path;
use std::sync::Arc;

/// What an image file says about itself before it is decoded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Header {
    /// Size of the stored pixels.
    pub stored: Size,
    /// Size after the camera's orientation tag (EXIF) is obeyed.
    pub upright: Size,
    /// The tag asks for a rotation or reflection.
    pub turned: bool,
    /// The file has an alpha channel.
    pub alpha: bool,
}

/// The pixels of a view: those in memory as they are, shared, or those of its files, decoded.
///
/// Of files, an EXIF orientation is obeyed, except where the camera has the size of the stored, unturned pixels. EXR is
/// linear and premultiplied by definition; it is divided by its alpha and sRGB-encoded.
pub fn load_photo(view: &View) -> Result<Photo, DataError> {
    let (path, mask, stored) = match &view.source {
        PhotoSource::Memory(photo) => return Ok(photo.clone()),
        PhotoSource::Files { image, mask, stored } => (image, mask, *stored),
    };
    let expected = stored_size(view, stored);
    let decoded = decode(path, Some(expected))?;
    let found = Size { width: decoded.width(), height: decoded.height() };
    if found != expected {
        return Err(DataError::ImageSize { path: path.clone(), found, expected });
    }
    let mask = mask.as_deref().map(|mask| load_mask(mask, path, expected)).transpose()?;
    let photo = Photo::new(to_image(path, decoded)?, mask);
    Ok(match stored {
        Some(Stored { crop, .. }) => {
            let photo = if crop.is_none() { photo } else { photo.cropped(crop) };
            let size = size_of(&view.camera);
            if [photo.image.width, photo.image.height] == size { photo } else { photo.reduced(size) }
        }
        None => photo,
    })
}

/// The size of the files of a view.
fn stored_size(view: &View, stored: Option<Stored>) -> Size {
    let [width, height] = stored.map_or(size_of(&view.camera), |s| s.size);
    Size { width, height }
}

/// The mask of a view as [`load_photo`] gives it, without the pixels of the image.
pub fn load_mask_of(view: &View) -> Result<Option<Arc<Mask>>, DataError> {
    match &view.source {
        PhotoSource::Memory(photo) => Ok(photo.mask.clone()),
        PhotoSource::Files { mask: None, .. } => Ok(None),
        PhotoSource::Files { image, mask: Some(mask), stored } => {
            let mask = load_mask(mask, image, stored_size(view, *stored))?;
            let reduced = stored.map(|s| mask.cropped(s.crop).reduced(size_of(&view.camera)));
            Ok(Some(Arc::new(reduced.unwrap_or(mask))))
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

/// Reads size and channels of an image without decoding it.
pub(crate) fn header(path: &Path) -> Result<Header, DataError> {
    let (decoder, orientation) = open(path)?;
    let (width, height) = decoder.dimensions();
    let stored = Size { width, height };
    let upright = if swaps_axes(orientation) { Size { width: height, height: width } } else { stored };
    let turned = orientation != Orientation::NoTransforms;
    Ok(Header { stored, upright, turned, alpha: decoder.color_type().has_alpha() })
}

/// True when some pixel of the image is not opaque.
pub(crate) fn is_see_through(path: &Path) -> Result<bool, DataError> {
    let image = decode(path, None)?;
    Ok(match image {
        DynamicImage::ImageRgba32F(image) => image.pixels().any(|p| p.0[3] < 1.0),
        image => image.to_rgba8().pixels().any(|p| p.0[3] < u8::MAX),
    })
}

/// The error for a mask that does not cover its image, from the mask's header.
pub(crate) fn check_mask_size(mask: &Path, image: &Path, expected: Size) -> Result<(), DataError> {
    let header = header(mask)?;
    let fits = header.stored == expected || header.upright == expected;
    fits.then_some(()).ok_or_else(|| DataError::MaskSize {
        mask: header.upright,
        path: mask.to_owned(),
        image: image.to_owned(),
        expected,
    })
}

/// Share of a mask's pixels that are mostly white.
pub(crate) fn white_share(mask: &Path) -> Result<f64, DataError> {
    let decoded = decode(mask, None)?.into_luma8();
    let white = decoded.as_raw().iter().filter(|c| **c > 127).count();
    Ok(white as f64 / decoded.as_raw().len().max(1) as f64)
}

fn load_mask(path: &Path, image: &Path, expected: Size) -> Result<Mask, DataError> {
    let decoded = decode(path, Some(expected))?.into_luma8();
    let (width, height) = decoded.dimensions();
    let mask = Size { width, height };
    if mask != expected {
        return Err(DataError::MaskSize { path: path.to_owned(), mask, image: image.to_owned(), expected });
    }
    Ok(Mask { width, height, coverage: decoded.into_raw() })
}

/// [`crate::photographs::turned_upright`].
pub(crate) fn turned_upright(path: &Path) -> Result<Option<Vec<u8>>, DataError> {
    let broken = |source| DataError::Decode { path: path.to_owned(), source };
    let (mut decoder, orientation) = open(path)?;
    if orientation == Orientation::NoTransforms {
        return Ok(None);
    }
    // Tags that cannot be read are no reason to refuse the pixels.
    let mut exif = decoder.exif_metadata().ok().flatten().unwrap_or_default();
    let profile = decoder.icc_profile().ok().flatten().unwrap_or_default();
    let mut image = DynamicImage::from_decoder(decoder).map_err(broken)?;
    image.apply_orientation(orientation);
    let _ = Orientation::remove_from_exif_chunk(&mut exif); // the orientation that was obeyed
    let mut bytes = Vec::new();
    let is_png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if is_png {
        let encoder = with_tags(PngEncoder::new(&mut bytes), exif, profile);
        image.write_with_encoder(encoder).map_err(broken)?;
    } else {
        let encoder = with_tags(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY), exif, profile);
        image.into_rgb8().write_with_encoder(encoder).map_err(broken)?;
    }
    Ok(Some(bytes))
}

/// Quality of photographs that are encoded anew, in percent: hardly to be told from the original.
const JPEG_QUALITY: u8 = 97;

/// The tags are for other programs; a format that cannot hold them loses nothing that is used here.
fn with_tags<E: ImageEncoder>(mut encoder: E, exif: Vec<u8>, profile: Vec<u8>) -> E {
    if !exif.is_empty() {
        let _ = encoder.set_exif_metadata(exif);
    }
    if !profile.is_empty() {
        let _ = encoder.set_icc_profile(profile);
    }
    encoder
}

/// [`crate::photographs::upright_mask`].
pub(crate) fn upright_mask(path: &Path, photograph: &Path) -> Result<Mask, DataError> {
    let (decoder, orientation) = open(photograph)?;
    let (width, height) = decoder.dimensions();
    let expected = header(photograph)?.upright;
    let mut mask = decode(path, Some(expected))?;
    let size = |mask: &DynamicImage| Size { width: mask.width(), height: mask.height() };
    if size(&mask) != expected && size(&mask) == (Size { width, height }) {
        mask.apply_orientation(orientation);
    }
    let found = size(&mask);
    if found != expected {
        let (path, image) = (path.to_owned(), photograph.to_owned());
        return Err(DataError::MaskSize { path, mask: found, image, expected });
    }
    Ok(Mask { width: found.width, height: found.height, coverage: mask.into_luma8().into_raw() })
}

/// The file's decoder, checked against the pixel limit, and its orientation tag.
fn open(path: &Path) -> Result<(impl ImageDecoder, Orientation), DataError> {
    decoder(path, ImageReader::open(path).map_err(unreadable(path))?)
}

fn unreadable(path: &Path) -> impl FnOnce(io::Error) -> DataError {
    let path = path.to_owned();
    move |source| DataError::Read { path, source }
}

/// The same of what is read from the file at `path`.
fn decoder(
    path: &Path,
    reader: ImageReader<impl BufRead + Seek + 'static>,
) -> Result<(impl ImageDecoder, Orientation), DataError> {
    let broken = |source| DataError::Decode { path: path.to_owned(), source };
    let mut reader = reader.with_guessed_format().map_err(unreadable(path))?;
    let mut allowed = Limits::default();
    allowed.max_alloc = Some(limits::IMAGE_PIXELS * 16 + (64 << 20)); // RGBA f32 and the decoder's own tables
    reader.limits(allowed);
    let mut decoder = reader.into_decoder().map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let found = u64::from(width) * u64::from(height);
    if found > limits::IMAGE_PIXELS {
        let (what, limit) = ("the image size [pixels]", limits::IMAGE_PIXELS);
        return Err(DataError::TooLarge { path: path.to_owned(), what, found, limit });
    }
    // A damaged tag is no reason to refuse the pixels.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    Ok((decoder, orientation))
}

/// The pixels, turned upright unless only the stored size is the `expected` one.
fn decode(path: &Path, expected: Option<Size>) -> Result<DynamicImage, DataError> {
    let content: Arc<[u8]> = limits::read(path, limits::BINARY_BYTES)?.into();
    let mut reader = ImageReader::new(Cursor::new(Arc::clone(&content)));
    if let Ok(format) = ImageFormat::from_path(path) {
        reader.set_format(format); // what the content does not show
    }
    let (decoder, orientation) = decoder(path, reader)?;
    jpeg::check(&content).map_err(|fault| DataError::Jpeg { path: path.to_owned(), fault })?;
    let (width, height) = decoder.dimensions();
    let mut image = DynamicImage::from_decoder(decoder)
        .map_err(|source: ImageError| DataError::Decode { path: path.to_owned(), source })?;
    let only_stored_fits =
        swaps_axes(orientation) && width != height && expected == Some(Size { width, height });
    if !only_stored_fits {
        image.apply_orientation(orientation);
    }
    Ok(image)
}

fn swaps_axes(orientation: Orientation) -> bool {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH)
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
fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
