//! From the files of a model to a parsed dataset.

use super::files::{cameras, file, has_both, images, most_sensors, points};
use super::records::{Calibrations, Image, Images};
use crate::extensions::is_picture;
use crate::folder::{file_in, folder_in, names};
use crate::formats::beside::{self, Maps, image_folder, photographs};
use crate::naming::key;
use crate::parsed::{Coloured, Frame, Loss, Origin, ParsedDataset};
use crate::pose::PoseFault;
use crate::root::{Root, Statement};
use crate::{DataError, Format, OpenOptions, Problem, limits, pose};
use refraxel_core::{Pose, Vec3};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file of the phone's captures of ScanNet++, whose models are in metres and whose depth maps are in millimetres.
const OF_IPHONE: &str = "pose_intrinsic_imu.json";
const MILLIMETRE: f64 = 1e-3;

/// Reads the model with the most images.
pub(crate) fn read(
    folder: &Path,
    candidates: &[PathBuf],
    options: &OpenOptions,
) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::below(&dataset_folder(folder), Format::Colmap, options)?;
    let (model, Images { all: images, doubts }) = largest(candidates, &mut parsed.problems)?;
    limits::frames(&model, images.len())?;
    let path = Arc::new(file(&model, "images").unwrap_or_default());
    if has_both(&model) {
        let message = format!("{}: the text files beside it are not read", path.display());
        parsed.problems.push(Problem::note(message));
    }
    parsed.problems.extend(doubts.into_iter().map(Problem::warning));
    let calibrations = cameras(&model, &images)?;
    let image_folder = image_folder(&parsed.root, images.iter().map(|image| image.name.as_str()));
    for image in &images {
        let origin = Origin { path: path.clone(), key: image.key.clone() };
        parsed.frames.push(frame(&parsed.root, &image_folder, image, &calibrations, origin)?);
    }
    if file_in(parsed.root.folder(), OF_IPHONE).is_some() {
        let maps = Maps { folder: "depth", extension: "png", unit: MILLIMETRE, size: None };
        beside::add_depth(&parsed.root, &mut parsed.frames, &maps);
    }
    parsed.problems.push(registered(&parsed.root, &image_folder, images.len()));
    parsed.problems.extend(rigs(&model));
    match points(&model, &HashSet::new()) {
        Ok(points) => {
            parsed.points = points.iter().map(|point| point.position).collect();
            parsed.coloured = Some(Coloured::Colmap(model));
        }
        Err(error) => parsed.problems.push(Problem::warning(format!("the points are not used: {error}"))),
    }
    Ok(parsed)
}

/// A note about cameras that move together; what cannot be read is not needed.
fn rigs(model: &Path) -> Option<Problem> {
    match most_sensors(model) {
        Ok(0 | 1) => None,
        Ok(count) => Some(Problem::note(format!(
            "the cameras are in rigs of up to {count}; the pose of each image is used, rigs are not"
        ))),
        Err(error) => Some(Problem::note(format!("rigs are not used: {error}"))),
    }
}

/// How many of the photographs COLMAP posed: a warning where it is less than half.
fn registered(root: &Root, image_folder: &str, count: usize) -> Problem {
    let total = count_images(&root.folder().join(image_folder), 0).max(count);
    let message = format!("{count} of {total} images are registered by COLMAP");
    if 2 * count < total { Problem::warning(message) } else { Problem::note(message) }
}

/// The images of the model that has most of them, and a warning when there were several or one cannot be read.
fn largest(candidates: &[PathBuf], problems: &mut Vec<Problem>) -> Result<(PathBuf, Images), DataError> {
    let (mut models, mut refused) = (Vec::new(), Vec::new());
    for model in candidates {
        match images(model) {
            Ok(images) => models.push((model, images)),
            Err(error) => refused.push(error),
        }
    }
    let sizes: Vec<String> =
        models.iter().map(|(m, images)| format!("{} ({} images)", m.display(), images.all.len())).collect();
    // Of equal ones, the first.
    let best = models.into_iter().rev().max_by_key(|(_, images)| images.all.len());
    let Some((model, images)) = best else { return Err(refused.swap_remove(0)) };
    let message = |error: &DataError| format!("one of the models of COLMAP is not used: {error}");
    problems.extend(refused.iter().map(|error| Problem::warning(message(error))));
    if sizes.len() > 1 {
        let (found, used) = (sizes.join(", "), model.display());
        let message = format!(
            "COLMAP made several models: {found}; the largest, {used}, is used; the others have other coordinates"
        );
        problems.push(Problem::warning(message));
    }
    Ok((model.clone(), images))
}

/// The dataset's folder when the user gave a model folder inside it.
fn dataset_folder(given: &Path) -> PathBuf {
    let real = given.canonicalize().unwrap_or_else(|_| given.to_owned());
    let name = |p: &Path| p.file_name().map(|name| key(&name.to_string_lossy())).unwrap_or_default();
    let inner = |p: &Path| {
        let is_usual = ["sparse", "colmap"].contains(&name(p).as_str()) || name(p).parse::<u32>().is_ok();
        // A folder called `sparse` may hold datasets as well.
        let is_model = || p == real && file(given, "cameras").is_some();
        is_usual || is_model() && p.parent().is_some_and(|above| name(above) == "sparse")
    };
    match real.ancestors().find(|p| !inner(p)) {
        Some(outer) if outer != real && folder_in(given, "images").is_none() => outer.to_owned(),
        _ => given.to_owned(),
    }
}

fn frame(
    root: &Root,
    folder: &str,
    image: &Image,
    calibrations: &Calibrations,
    origin: Origin,
) -> Result<Frame, DataError> {
    let is_known = image.quaternion.iter().chain(&image.translation).all(|v| v.is_finite());
    if !is_known || image.quaternion == [0.0; 4] {
        return Ok(Frame::lost(origin, image.name.clone(), Loss::NoPose));
    }
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
    Ok(beside::frame(origin, image.name.as_str(), found, intrinsics, pose))
}

/// Photographs in a folder and below; stops at a depth and number that no folder of photographs reaches.
fn count_images(folder: &Path, depth: usize) -> usize {
    const DEPTH: usize = 6;
    let names = names(folder).unwrap_or_default();
    let others = names.iter().take(limits::FRAMES).filter(|name| !is_picture(name) && depth < DEPTH);
    let folders = others.map(|name| folder.join(name)).filter(|path| !path.is_symlink() && path.is_dir());
    folders.map(|path| count_images(&path, depth + 1)).sum::<usize>() + photographs(names).len()
}
