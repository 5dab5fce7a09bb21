//! Photographs that are turned upright before programs pose them.

use crate::{DataError, decoding};
use ::image::codecs::{jpeg::JpegEncoder, png::PngEncoder, tiff::TiffEncoder, webp::WebPEncoder};
use ::image::metadata::Orientation as Turn;
use ::image::{DynamicImage, ImageDecoder, ImageEncoder, ImageFormat};
use std::io::Cursor;
use std::path::Path;

/// [`crate::photographs::turned_upright`].
pub(crate) fn turned_upright(path: &Path) -> Result<Option<Vec<u8>>, DataError> {
    let broken = |source| DataError::Decode { path: path.to_owned(), source };
    let mut decoder = decoding::open(path)?;
    let turn = decoder.orientation().unwrap_or(Turn::NoTransforms);
    if turn == Turn::NoTransforms {
        return Ok(None);
    }
    // Tags that cannot be read are no reason to refuse the pixels.
    let mut exif = decoder.exif_metadata().ok().flatten().unwrap_or_default();
    let profile = decoder.icc_profile().ok().flatten().unwrap_or_default();
    let mut image = DynamicImage::from_decoder(decoder).map_err(broken)?;
    image.apply_orientation(turn);
    let _ = Turn::remove_from_exif_chunk(&mut exif); // the orientation that was obeyed
    let mut bytes = Vec::new();
    match ImageFormat::from_path(path) {
        Ok(ImageFormat::Png) => {
            let encoder = with_tags(PngEncoder::new(&mut bytes), exif, profile);
            image.write_with_encoder(encoder).map_err(broken)?;
        }
        Ok(ImageFormat::Tiff) => {
            image.write_with_encoder(TiffEncoder::new(Cursor::new(&mut bytes))).map_err(broken)?;
        }
        Ok(ImageFormat::WebP) => {
            let encoder = with_tags(WebPEncoder::new_lossless(&mut bytes), exif, profile);
            image.write_with_encoder(encoder).map_err(broken)?;
        }
        _ => {
            let encoder = with_tags(JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY), exif, profile);
            image.into_rgb8().write_with_encoder(encoder).map_err(broken)?;
        }
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
