//! `cameras.bin`, `images.bin`, `points3D.bin`.

use super::models::{self, Calibration};
use super::records::{Calibrations, Image, Images, Point};
use crate::DataError;
use crate::bytes::Bytes;
use refraxel_core::Vec3;
use std::collections::HashSet;
use std::path::Path;

/// u64 n; each: u32 id, i32 model, u64 width, u64 height, f64 parameters. What follows a camera of unknown length cannot be
/// read, and need not be where no image uses it.
pub(super) fn cameras(path: &Path, content: &[u8], used: &HashSet<u32>) -> Result<Calibrations, DataError> {
    const EXPECTED: &str = "cameras of COLMAP (id, model, width, height, parameters)";
    let mut bytes = Bytes::new(path, content);
    let count = bytes.u64(EXPECTED)?;
    bytes.check_count(count, 24, EXPECTED)?;
    let mut cameras = Calibrations::new();
    for _ in 0..count {
        match camera(path, &mut bytes) {
            Ok((id, calibration)) => drop(cameras.insert(id, calibration)),
            Err(_) if used.iter().all(|id| cameras.contains_key(id)) => break,
            Err(error) => return Err(error),
        }
    }
    Ok(cameras)
}

fn camera(path: &Path, bytes: &mut Bytes) -> Result<(u32, Calibration), DataError> {
    const EXPECTED: &str = "a camera of COLMAP (id, model, width, height, parameters)";
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
    Ok((id, Calibration { path: path.to_owned(), key, model, size, parameters: parameters? }))
}

/// u64 n; each: u32 id, f64 quaternion (w x y z), f64 translation, u32 camera, NUL-terminated name, u64 m and m
/// observations of 24 bytes. Images beyond the stated number are read, too, as far as they are whole.
pub(super) fn images(path: &Path, content: &[u8]) -> Result<Images, DataError> {
    const EXPECTED: &str = "images of COLMAP (id, pose, camera, name, observations)";
    let mut bytes = Bytes::new(path, content);
    let count = bytes.u64(EXPECTED)?;
    bytes.check_count(count, 73, EXPECTED)?;
    let mut images = Images::default();
    for _ in 0..count {
        images.all.push(image(&mut bytes)?);
    }
    if bytes.left() > 0 {
        let behind = bytes.left();
        while bytes.left() > 0
            && let Ok(image) = image(&mut bytes)
        {
            images.all.push(image);
        }
        images.doubts.push(format!(
            "{}: it states {count} images, and {behind} bytes follow them, which hold {} more, used as well; export the \
             model again if that is wrong",
            path.display(),
            images.all.len() as u64 - count
        ));
    }
    Ok(images)
}

fn image(bytes: &mut Bytes) -> Result<Image, DataError> {
    const EXPECTED: &str = "an image of COLMAP (id, pose, camera, name, observations)";
    let id = bytes.u32(EXPECTED)?;
    let key = format!("image {id}");
    let (quaternion, translation) = (bytes.f64s(EXPECTED)?, bytes.f64s(EXPECTED)?);
    let (camera, name) = (bytes.u32(EXPECTED)?, bytes.text(EXPECTED)?);
    let observations = bytes.u64(EXPECTED)?;
    bytes.skip(observations, 24, EXPECTED)?;
    Ok(Image { id, key, quaternion, translation, camera, name })
}

/// u64 n; each: u32 id, u32 number of sensors, and, where it is not 0, i32 type and u32 id of the first, then of each other one i32 type,
/// u32 id, u8 whether a pose follows, and seven f64. The largest number of sensors.
pub(super) fn most_sensors(path: &Path, content: &[u8]) -> Result<u32, DataError> {
    const EXPECTED: &str = "rigs of COLMAP (id, sensors)";
    let mut bytes = Bytes::new(path, content);
    let count = bytes.u64(EXPECTED)?;
    bytes.check_count(count, 8, EXPECTED)?;
    let mut most = 0;
    for _ in 0..count {
        bytes.u32(EXPECTED)?;
        let sensors = bytes.u32(EXPECTED)?;
        bytes.take(if sensors > 0 { 8 } else { 0 }, EXPECTED)?;
        for _ in 1..sensors {
            bytes.take(8, EXPECTED)?;
            let has_pose = bytes.take(1, EXPECTED)? != [0];
            bytes.take(if has_pose { 56 } else { 0 }, EXPECTED)?;
        }
        most = most.max(sensors);
    }
    Ok(most)
}

/// u64 n; each: u64 id, f64 position, 3 u8 colour, f64 error, u64 m and m track elements of 8 bytes. Points that are
/// not finite are dropped. Of tracks, those of the `wanted` images are kept.
pub(super) fn points(path: &Path, content: &[u8], wanted: &HashSet<u32>) -> Result<Vec<Point>, DataError> {
    const EXPECTED: &str = "points of COLMAP (id, position, colour, error, track)";
    let mut bytes = Bytes::new(path, content);
    let count = bytes.u64(EXPECTED)?;
    bytes.check_count(count, 51, EXPECTED)?;
    let mut points = Vec::new();
    for _ in 0..count {
        bytes.u64(EXPECTED)?;
        let position = Vec3::from(bytes.f64s::<3>(EXPECTED)?);
        let colour = bytes.take(3, EXPECTED)?.try_into().ok();
        let [error] = bytes.f64s(EXPECTED)?;
        let track = bytes.u64(EXPECTED)?;
        bytes.check_count(track, 8, EXPECTED)?;
        let track = bytes.take(8 * track as usize, EXPECTED)?;
        let ids = track
            .chunks_exact(8)
            .filter_map(|element| element.first_chunk().map(|id| u32::from_le_bytes(*id)));
        let seen_by =
            if wanted.is_empty() { Vec::new() } else { ids.filter(|id| wanted.contains(id)).collect() };
        points.extend(position.is_finite().then_some(Point {
            position,
            error: Some(error),
            colour,
            seen_by,
        }));
    }
    Ok(points)
}
