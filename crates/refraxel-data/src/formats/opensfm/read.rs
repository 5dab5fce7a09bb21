//! From a reconstruction to a parsed dataset.
//!
//! Poses are world-to-camera with OpenCV axes, as a rotation vector and a translation. Lengths in the picture are in units of its
//! longer edge, from the middle of the picture.

use super::parse::{Reconstruction, parse};
use crate::folder::above;
use crate::formats::beside::{frame, image_folder};
use crate::formats::lens::{fisheye, opencv};
use crate::json::Object;
use crate::parsed::{Focal, Intrinsics, Origin, ParsedDataset};
use crate::root::Statement;
use crate::{DataError, Format, OpenOptions, Problem, limits};
use refraxel_core::{Lens, Mat3, Pose, Vec3, vec3};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The reconstruction of a folder of OpenSfM or of OpenDroneMap.
pub(crate) fn find(folder: &Path) -> Option<PathBuf> {
    ["reconstruction.json", "opensfm/reconstruction.json"]
        .map(|name| folder.join(name))
        .into_iter()
        .find(|p| p.is_file())
}

/// Reads the largest reconstruction of the file, whose photographs lie in `folder`.
pub(crate) fn read(folder: &Path, file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::below(&above(folder, "opensfm"), Format::OpenSfm, options)?;
    let all: Vec<Reconstruction> = parse(file)?;
    let Reconstruction { cameras, shots, points, reference_lla } = largest(file, all, &mut parsed.problems)?;
    limits::frames(file, shots.len())?;
    let cameras = Value::Object(cameras);
    let cameras = Object::new(file, "cameras", &cameras)?;
    let images = image_folder(&parsed.root, shots.keys().map(String::as_str).collect::<Vec<_>>().into_iter());
    let path = Arc::new(file.to_owned());
    for (name, shot) in &shots {
        let origin = Origin { path: path.clone(), key: format!("shots.{name}") };
        let shot = Object::new(file, &origin.key, shot)?;
        let image = parsed.root.find_below(&images, name, Statement { path: file, key: &origin.key })?;
        let (intrinsics, pose) = (intrinsics_of(&shot, &cameras)?, pose_of(&shot)?);
        parsed.frames.push(frame(origin, name, image, intrinsics, pose));
    }
    parsed.points = points.0;
    if is_somewhere(&reference_lla) {
        // Positions of satellites were used: x points to the east, y to the north.
        parsed.up = Some(vec3(0.0, 0.0, 1.0));
    }
    Ok(parsed)
}

fn largest(
    file: &Path,
    mut all: Vec<Reconstruction>,
    problems: &mut Vec<Problem>,
) -> Result<Reconstruction, DataError> {
    let sizes: Vec<String> = all.iter().map(|r| r.shots.len().to_string()).collect();
    all.sort_by_key(|r| std::cmp::Reverse(r.shots.len()));
    if all.len() > 1 {
        problems.push(Problem::warning(format!(
            "{}: OpenSfM made several reconstructions, of {} photographs; the largest is used; the others have other \
             coordinates",
            file.display(),
            sizes.join(", ")
        )));
    }
    all.into_iter().next().ok_or_else(|| DataError::NoCameras { path: file.to_owned() })
}

/// Whether the origin is a known place on the earth.
fn is_somewhere(reference: &Value) -> bool {
    ["latitude", "longitude"]
        .iter()
        .any(|key| reference.get(key).and_then(Value::as_f64).is_some_and(|v| v != 0.0))
}

fn pose_of(shot: &Object) -> Result<Pose, DataError> {
    let three = |key: &str| {
        let numbers = shot.numbers::<3>(key, "three finite numbers")?;
        numbers.map(Vec3::from).ok_or_else(|| shot.wrong(key, "three finite numbers (world to camera)"))
    };
    let rotation = Mat3::turning(three("rotation")?).transpose();
    Ok(Pose { rotation, translation: -(rotation * three("translation")?) })
}

fn intrinsics_of(shot: &Object, cameras: &Object) -> Result<Intrinsics, DataError> {
    const EXPECTED: &str = "the id of a camera in cameras";
    let id = shot.text("camera")?.ok_or_else(|| shot.wrong("camera", EXPECTED))?;
    let (place, camera) = (cameras.key(id), cameras.get(id).ok_or_else(|| shot.wrong("camera", EXPECTED))?);
    let camera = Object::new(cameras.path(), &place, camera)?;
    let edge = |key: &str| {
        let found = camera.number(key)?.filter(|v| (1.0..=1e6).contains(v));
        found.ok_or_else(|| camera.wrong(key, "a size from 1 to 1000000 pixels"))
    };
    let size @ [w, h] = [edge("width")?, edge("height")?];
    let model = camera.text("projection_type")?.unwrap_or("perspective");
    if matches!(model, "spherical" | "equirectangular") {
        let (focal, lens) = (Focal::Panorama, Lens::Equirectangular);
        return Ok(Intrinsics { size: Some(size), focal, center: None, lens });
    }
    let unit = w.max(h);
    let number = |key: &str| camera.number(key).map(Option::unwrap_or_default);
    let focal = match (camera.number("focal")?, camera.number("focal_x")?, camera.number("focal_y")?) {
        (_, Some(x), y) => [x, y.unwrap_or(x)],
        (Some(f), None, _) => [f, f],
        (None, None, _) => return Err(camera.wrong("focal", "focal or focal_x [longer edge of the picture]")),
    };
    let center = [0.5 * w + number("c_x")? * unit, 0.5 * h + number("c_y")? * unit];
    let focal = Focal::Pixels(focal.map(|f| f * unit));
    Ok(Intrinsics { size: Some(size), focal, center: Some(center), lens: lens(&camera, model)? })
}

fn lens(camera: &Object, model: &str) -> Result<Lens, DataError> {
    let number = |key: &str| camera.number(key).map(Option::unwrap_or_default);
    let unsupported = |key: &str, model: &str| {
        let (path, model) = (camera.path().to_owned(), format!("{model} (OpenSfM)"));
        Err(DataError::UnsupportedCamera { path, key: camera.key(key), model })
    };
    let [k1, k2, k3, k4] = [number("k1")?, number("k2")?, number("k3")?, number("k4")?];
    let p = [number("p1")?, number("p2")?];
    let is_simple = number("k5")? == 0.0 && number("k6")? == 0.0;
    match (model, is_simple) {
        ("perspective" | "radial" | "simple_radial", _) => Ok(opencv([k1, k2, 0.0, 0.0], [0.0; 2])),
        ("brown", _) => Ok(opencv([k1, k2, k3, 0.0], p)),
        ("fisheye", _) => Ok(fisheye([k1, k2, 0.0, 0.0], [0.0; 2])),
        ("fisheye_opencv", _) => Ok(fisheye([k1, k2, k3, k4], [0.0; 2])),
        ("fisheye62", true) => Ok(fisheye([k1, k2, k3, k4], p)),
        ("fisheye62", false) => unsupported("k5", "fisheye62 with k5 or k6"),
        _ => unsupported("projection_type", model),
    }
}
