//! `cameras.bin`, `images.bin`, `points3D.bin`.

use super::models::{self, Calibration};
use super::records::{Calibrations, Image, Point};
use crate::DataError;
use crate::bytes::Bytes;
use refraxel_core::Vec3;
use std::path::Path;

/// u64 n; each: u32 id, i32 model, u64 width, u64 height, f64 parameters.
pub(super) fn cameras(path: &Path, content: &[u8]) -> Result<Calibrations, DataError> {
    const EXPECTED: &str = "cameras of COLMAP (id, model, width, height, parameters)";
    let mut bytes = Bytes::new(path, content);
    let count = bytes.u64(EXPECTED)?;
    bytes.check_count(count, 24, EXPECTED)?;
    let mut cameras = Calibrations::new();
    for _ in 0..count {
        let (id, model) = (bytes.u32(EXPECTED)?, bytes.u32(EXPECTED)? as i32);
        let key = format!("camera {id}");
        let (name, parameter_count) = models::by_id(model).ok_or_else(|| DataError::UnsupportedCamera {
            path: path.to_owned(),
            key: key.clone(),
            model: format!("number {model}"),
        })?;
        let size = [bytes.u64(EXPECTED)?, bytes.u64(EXPECTED)?];
        let parameters: Result<Vec<f64>, _> =
            (0..parameter_count).map(|_| bytes.f64s::<1>(EXPECTED).map(|[v]| v)).collect();
        let model = name.to_owned();
        cameras.insert(id, Calibration { path: path.to_owned(), key, model, size, parameters: parameters? });
    }
    Ok(cameras)
}

/// u64 n; each: u32 id, f64 quaternion (w x y z), f64 translation, u32 camera, NUL-terminated name, u64 m and m
/// observations of 24 bytes.
pub(super) fn images(path: &Path, content: &[u8]) -> Result<Vec<Image>, DataError> {
    const EXPECTED: &str = "images of COLMAP (id, pose, camera, name, observations)";
    let mut bytes = Bytes::new(path, content);
    let count = bytes.u64(EXPECTED)?;
    bytes.check_count(count, 73, EXPECTED)?;
    let mut images = Vec::new();
    for _ in 0..count {
        let key = format!("image {}", bytes.u32(EXPECTED)?);
        let (quaternion, translation) = (bytes.f64s(EXPECTED)?, bytes.f64s(EXPECTED)?);
        let (camera, name) = (bytes.u32(EXPECTED)?, bytes.text(EXPECTED)?);
        let observations = bytes.u64(EXPECTED)?;
        bytes.skip(observations, 24, EXPECTED)?;
        images.push(Image { key, quaternion, translation, camera, name });
    }
    Ok(images)
}

/// u64 n; each: u64 id, f64 position, 3 u8 colour, f64 error, u64 m and m track elements of 8 bytes. Points that are
/// not finite are dropped.
pub(super) fn points(path: &Path, content: &[u8]) -> Result<Vec<Point>, DataError> {
    const EXPECTED: &str = "points of COLMAP (id, position, colour, error, track)";
    let mut bytes = Bytes::new(path, content);
    let count = bytes.u64(EXPECTED)?;
    bytes.check_count(count, 51, EXPECTED)?;
    let mut points = Vec::new();
    for _ in 0..count {
        bytes.u64(EXPECTED)?;
        let position = Vec3::from(bytes.f64s::<3>(EXPECTED)?);
        bytes.take(3, EXPECTED)?; // colour
        let [error] = bytes.f64s(EXPECTED)?;
        let track = bytes.u64(EXPECTED)?;
        bytes.skip(track, 8, EXPECTED)?;
        points.extend(position.is_finite().then_some(Point { position, error: Some(error) }));
    }
    Ok(points)
}
