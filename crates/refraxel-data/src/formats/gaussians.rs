//! `cameras.json` of 3D Gaussian Splatting: a list of {id, img_name, width, height, position, rotation, fx, fy}.
//!
//! `rotation` is from camera to world, row by row, with OpenCV axes; `position` is where the camera stands. The principal point is the
//! middle of the picture, and there is no distortion.

use super::beside::{frame, image_folder};
use super::ply;
use crate::json::{self, Object};
use crate::parsed::{Focal, Frame, Intrinsics, Origin, ParsedDataset};
use crate::root::Statement;
use crate::{DataError, Format, OpenOptions, Problem, limits};
use refraxel_core::{Lens, Mat3, Pose, Vec3};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The file of cameras in a folder.
pub(crate) fn find(folder: &Path) -> Option<PathBuf> {
    let file = folder.join("cameras.json");
    let keys = ["\"position\"", "\"rotation\"", "\"fx\""];
    let is_it = limits::read_text(&file)
        .is_ok_and(|text| text.trim_start().starts_with('[') && keys.iter().all(|key| text.contains(key)));
    is_it.then_some(file)
}

/// Reads the cameras of a file.
pub(crate) fn read(file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::beside(file, Format::GaussianSplatting, options)?;
    let value = json::read(file)?;
    let list = value.as_array();
    let list = list
        .ok_or_else(|| json::wrong(file, String::new(), &value, "a list of cameras [{\"img_name\": …}]"))?;
    limits::frames(file, list.len())?;
    let cameras = list.iter().enumerate().map(|(i, value)| Camera::of(file, format!("[{i}]"), value));
    let cameras = cameras.collect::<Result<Vec<_>, _>>()?;
    let images = image_folder(&parsed.root, cameras.iter().map(|c| c.name.as_str()));
    let path = Arc::new(file.to_owned());
    for Camera { key, name, intrinsics, pose } in cameras {
        let image = parsed.root.find_below(&images, &name, Statement { path: file, key: &key })?;
        let (origin, file) = (Origin { path: path.clone(), key }, name);
        parsed.frames.push(frame(origin, file, image, intrinsics, pose));
    }
    refuse_output(file, &parsed.frames)?;
    read_points(&mut parsed);
    Ok(parsed)
}

/// Refuses the folder that a training wrote, where the photographs are not.
fn refuse_output(file: &Path, frames: &[Frame]) -> Result<(), DataError> {
    let Some(first) = frames.first().filter(|_| frames.iter().all(|frame| frame.image.is_none())) else {
        return Ok(());
    };
    let settings = file.with_file_name("cfg_args");
    let text = limits::read_text(&settings).unwrap_or_default();
    let source = text.split_once("source_path='").and_then(|(_, rest)| rest.split_once('\''));
    let Some((source, _)) = source else { return Ok(()) };
    let there = format!(
        "a training wrote this folder from the data in {source}, as {} says: give that folder",
        settings.display()
    );
    let (path, count, first) = (file.to_owned(), frames.len(), first.file.clone());
    Err(DataError::AllImagesMissing { path, count, first, there })
}

struct Camera {
    key: String,
    name: String,
    intrinsics: Intrinsics,
    pose: Pose,
}

impl Camera {
    fn of(file: &Path, key: String, value: &Value) -> Result<Self, DataError> {
        const ROWS: &str = "three rows of three finite numbers (camera to world)";
        let camera = Object::new(file, &key, value)?;
        let number = |key: &str, expected| {
            camera.number(key)?.filter(|v| *v > 0.0).ok_or_else(|| camera.wrong(key, expected))
        };
        let name =
            camera.text("img_name")?.ok_or_else(|| camera.wrong("img_name", "the image's file name"))?;
        let name = name.to_owned();
        let size = [number("width", "a width > 0 [pixel]")?, number("height", "a height > 0 [pixel]")?];
        let focal = ["fx", "fy"].map(|key| number(key, "a focal length > 0 [pixel]"));
        let [fx, fy] = focal;
        let rows = camera.matrix::<3, 3>("rotation", ROWS)?.ok_or_else(|| camera.wrong("rotation", ROWS))?;
        let position = camera.numbers::<3>("position", "three finite numbers")?;
        let position = position.ok_or_else(|| camera.wrong("position", "three finite numbers"))?;
        let pose = Pose { rotation: Mat3::from_rows(rows), translation: Vec3::from(position) };
        let focal = Focal::Pixels([fx?, fy?]);
        let intrinsics = Intrinsics { size: Some(size), focal, center: None, lens: Lens::Pinhole };
        Ok(Self { key, name, intrinsics, pose })
    }
}

/// The points from which the Gaussians began (`input.ply`). They only help to place the region, so a broken file is a warning.
fn read_points(parsed: &mut ParsedDataset) {
    let file = parsed.root.folder().join("input.ply");
    if !file.is_file() || !parsed.root.contains(&file) {
        return;
    }
    match limits::read(&file, limits::BINARY_BYTES).and_then(|content| ply::points(&file, &content)) {
        Ok(points) => parsed.points = points,
        Err(error) => parsed.problems.push(Problem::warning(format!("the points are not used: {error}"))),
    }
}
