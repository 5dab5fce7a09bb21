//! Encoded pictures of a frame.
//!
//! Depth: 16-bit grey PNG in units of 1e-4 scene units along the optical axis, 0 = background. Normals: 16-bit RGB PNG,
//! world axes, 65535 (n + 1) / 2 rounded, (0, 0, 0) = background. Linear colour: 32-bit float OpenEXR.

use super::super::error::SynthError;
use super::super::render::Frame;
use crate::image::{Image, Mask, Pixels};
use crate::quantize::quantize;
use image::codecs::openexr::OpenExrEncoder;
use image::{ColorType, ExtendedColorType, ImageEncoder};
use std::io::Cursor;
use std::path::Path;

/// Scene units per step of a depth picture.
pub const DEPTH_UNIT: f64 = 1e-4;

fn png(path: &Path, bytes: &[u8], size: [u32; 2], color: ColorType) -> Result<Vec<u8>, SynthError> {
    let mut out = Vec::new();
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(bytes, size[0], size[1], ExtendedColorType::from(color))
        .map_err(|source| SynthError::Picture { action: "encode", path: path.into(), source })?;
    Ok(out)
}

pub(super) fn color_png(path: &Path, picture: &Image) -> Result<Vec<u8>, SynthError> {
    let bytes: Vec<u8> = match &picture.pixels {
        Pixels::U8(v) => v.clone(),
        Pixels::F32(v) => v.iter().copied().map(quantize).collect(),
    };
    let color = if picture.channels == 4 { ColorType::Rgba8 } else { ColorType::Rgb8 };
    png(path, &bytes, [picture.width, picture.height], color)
}

/// A picture as JPEG of this quality, of 100.
pub(super) fn color_jpeg(path: &Path, picture: &Image, quality: u8) -> Result<Vec<u8>, SynthError> {
    let mut out = Vec::new();
    let bytes: Vec<u8> = (0..(picture.width * picture.height) as usize)
        .flat_map(|p| picture.rgba(p)[..3].to_vec())
        .map(quantize)
        .collect();
    image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, quality)
        .write_image(&bytes, picture.width, picture.height, ExtendedColorType::Rgb8)
        .map_err(|source| SynthError::Picture { action: "encode", path: path.into(), source })?;
    Ok(out)
}

pub(super) fn mask_png(path: &Path, mask: &Mask) -> Result<Vec<u8>, SynthError> {
    png(path, &mask.coverage, [mask.width, mask.height], ColorType::L8)
}

/// PNG encoders of the image crate take 16-bit samples in native byte order.
fn native(samples: impl Iterator<Item = u16>) -> Vec<u8> {
    samples.flat_map(u16::to_ne_bytes).collect()
}

pub(super) fn depth_png(path: &Path, frame: &Frame) -> Result<Vec<u8>, SynthError> {
    let code = |d: &f64| (d / DEPTH_UNIT).round().clamp(0.0, 65535.0) as u16;
    png(path, &native(frame.depth.iter().map(code)), frame.size, ColorType::L16)
}

pub(super) fn normal_png(path: &Path, frame: &Frame) -> Result<Vec<u8>, SynthError> {
    let code = |n: &refraxel_core::Vec3<f64>| {
        let none = n.dot(*n) == 0.0;
        n.to_array().map(|c| if none { 0 } else { (65535.0 * 0.5 * (c + 1.0)).round() as u16 })
    };
    png(path, &native(frame.normal.iter().flat_map(code)), frame.size, ColorType::Rgb16)
}

pub(super) fn linear_exr(path: &Path, frame: &Frame) -> Result<Vec<u8>, SynthError> {
    let samples: Vec<f32> = frame.color.iter().flatten().map(|&c| c as f32).collect();
    let picture = image::Rgb32FImage::from_raw(frame.size[0], frame.size[1], samples).unwrap_or_default();
    let mut out = Cursor::new(Vec::new());
    image::DynamicImage::from(picture)
        .write_with_encoder(OpenExrEncoder::new(&mut out))
        .map_err(|source| SynthError::Picture { action: "encode", path: path.into(), source })?;
    Ok(out.into_inner())
}

/// A grid of equally large pictures on grey, `gap` pixels apart; rows of the grid as given.
pub(super) fn sheet(rows: &[Vec<Image>], gap: u32) -> Image {
    let [w, h] = rows.first().and_then(|r| r.first()).map_or([1, 1], |i| [i.width, i.height]);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(1) as u32;
    let (width, height) = (gap + columns * (w + gap), gap + rows.len() as u32 * (h + gap));
    let mut pixels = vec![96u8; (width * height * 3) as usize];
    for (j, row) in rows.iter().enumerate() {
        for (i, picture) in row.iter().enumerate() {
            for y in 0..h {
                for x in 0..w {
                    let rgba = picture.rgba((y * w + x) as usize);
                    let at = (gap + j as u32 * (h + gap) + y) * width + gap + i as u32 * (w + gap) + x;
                    for c in 0..3 {
                        pixels[at as usize * 3 + c] = quantize(rgba[c]);
                    }
                }
            }
        }
    }
    Image { width, height, channels: 3, pixels: Pixels::U8(pixels) }
}

/// Normals as colours for people, grey where there is nothing.
pub(super) fn normal_picture(frame: &Frame) -> Image {
    let code = |n: &refraxel_core::Vec3<f64>| n.to_array().map(|c| (127.5 * (c + 1.0)).round() as u8);
    let pixels = frame.normal.iter().flat_map(code).collect();
    Image { width: frame.size[0], height: frame.size[1], channels: 3, pixels: Pixels::U8(pixels) }
}

/// A mask as a grey picture.
pub(super) fn mask_picture(mask: &Mask) -> Image {
    let pixels = mask.coverage.iter().flat_map(|&c| [c; 3]).collect();
    Image { width: mask.width, height: mask.height, channels: 3, pixels: Pixels::U8(pixels) }
}
