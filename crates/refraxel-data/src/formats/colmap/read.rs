//! From the files of a model to a parsed dataset.

use super::files::{file, images, is_binary, points};
use super::records::{Calibrations, Image};
use super::{binary, text};
use crate::formats::folder::is_image;
use crate::parsed::{Frame, Origin, ParsedDataset};
use crate::pose::PoseFault;
use crate::root::{Root, Statement};
use crate::{DataError, Format, OpenOptions, Problem, limits, pose};
use refraxel_core::{Pose, Vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads the model with the most images.
pub(crate) fn read(
    folder: &Path,
    candidates: &[PathBuf],
    options: &OpenOptions,
) -> Result<ParsedDataset, DataError> {
    let mut parsed =
        ParsedDataset::new(Root::new(&dataset_folder(folder), options.allow_outside)?, Format::Colmap);
    let (model, images) = largest(candidates, &mut parsed.problems)?;
    limits::frames(&model, images.len())?;
    let cameras_file = file(&model, "cameras").unwrap_or_default();
    let calibrations = match is_binary(&cameras_file) {
        true => binary::cameras(&cameras_file, &limits::read(&cameras_file, limits::BINARY_BYTES)?)?,
        false => text::cameras(&cameras_file, &limits::read_text(&cameras_file)?)?,
    };
    let path = Arc::new(file(&model, "images").unwrap_or_default());
    let image_folder = image_folder(&parsed.root, &path, &images)?;
    for image in &images {
        let origin = Origin { path: path.clone(), key: image.key.clone() };
        parsed.frames.push(frame(&parsed.root, &image_folder, image, &calibrations, origin)?);
    }
    let total = count_images(&parsed.root.folder().join(&image_folder), 0).max(images.len());
    parsed
        .problems
        .push(Problem::note(format!("{} of {total} images are registered by COLMAP", images.len())));
    parsed.points = points(&model)?.iter().map(|point| point.position).collect();
    Ok(parsed)
}

/// The images of the model that has most of them, and a note when there were several.
fn largest(candidates: &[PathBuf], problems: &mut Vec<Problem>) -> Result<(PathBuf, Vec<Image>), DataError> {
    let mut best: (PathBuf, Vec<Image>) = Default::default();
    let mut sizes = Vec::new();
    for model in candidates {
        let images = images(model)?;
        sizes.push(format!("{} ({} images)", model.display(), images.len()));
        if best.0.as_os_str().is_empty() || images.len() > best.1.len() {
            best = (model.clone(), images);
        }
    }
    if sizes.len() > 1 {
        let (found, used) = (sizes.join(", "), best.0.display());
        let message = format!(
            "COLMAP made several models: {found}; the largest, {used}, is used; the others have other coordinates"
        );
        problems.push(Problem::warning(message));
    }
    Ok(best)
}

/// The dataset's folder when the user gave a model folder inside it.
fn dataset_folder(given: &Path) -> PathBuf {
    let inner = |p: &Path| {
        let name = p.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        name == "sparse" || name == "colmap" || name.parse::<u32>().is_ok()
    };
    let real = given.canonicalize().unwrap_or_else(|_| given.to_owned());
    match real.ancestors().find(|p| !inner(p)) {
        Some(outer) if outer != real && !given.join("images").is_dir() => outer.to_owned(),
        _ => given.to_owned(),
    }
}

/// The folder, relative to the dataset, that holds most of the images: `images`, then others named so, then the root.
fn image_folder(root: &Root, path: &Path, images: &[Image]) -> Result<String, DataError> {
    let entries = std::fs::read_dir(root.folder()).into_iter().flatten().flatten();
    let mut named: Vec<String> = entries
        .filter_map(|e| e.file_name().into_string().ok())
        .filter(|name| name.starts_with("images_") || name == "input")
        .collect();
    named.sort();
    let mut best = (0, "images".to_owned());
    for folder in std::iter::once("images".to_owned()).chain(named).chain([".".to_owned()]) {
        let mut count = 0;
        for image in images {
            let by = Statement { path, key: &image.key };
            count += usize::from(root.find_below(&folder, &image.name, by)?.is_some());
        }
        if count > best.0 {
            best = (count, folder);
        }
        if best.0 == images.len() {
            break;
        }
    }
    Ok(best.1)
}

fn frame(
    root: &Root,
    folder: &str,
    image: &Image,
    calibrations: &Calibrations,
    origin: Origin,
) -> Result<Frame, DataError> {
    let in_pose =
        |fault: PoseFault| DataError::Pose { path: origin.path.to_path_buf(), key: image.key.clone(), fault };
    let camera_from_world = pose::rotation_of_quaternion(image.quaternion).map_err(in_pose)?;
    let rotation = camera_from_world.transpose();
    let pose = Pose { rotation, translation: -(rotation * Vec3::from(image.translation)) };
    let calibration = calibrations.get(&image.camera).ok_or_else(|| DataError::Value {
        path: origin.path.to_path_buf(),
        key: format!("{} (CAMERA_ID)", image.key),
        found: image.camera.to_string(),
        expected: "the id of a camera in the cameras file",
    })?;
    let by = Statement { path: &origin.path, key: &image.key };
    let found = root.find_below(folder, &image.name, by)?;
    let intrinsics = calibration.intrinsics()?;
    Ok(Frame { file: image.name.clone(), image: found, mask: None, part: None, intrinsics, pose, origin })
}

/// Image files in a folder and below; stops at a depth and number that no photograph folder reaches.
fn count_images(folder: &Path, depth: usize) -> usize {
    const DEPTH: usize = 6;
    let is_image = |p: &Path| p.file_name().and_then(|n| n.to_str()).is_some_and(is_image);
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().take(limits::FRAMES);
    let count = entries.map(|entry| match entry.path() {
        path if is_image(&path) => 1,
        path if depth < DEPTH && entry.file_type().is_ok_and(|t| t.is_dir()) => {
            count_images(&path, depth + 1)
        }
        _ => 0,
    });
    count.sum()
}
