//! Where models and their files lie, and what those hold, binary or text.

use super::records::{Image, Point};
use super::{binary, text};
use crate::{DataError, limits};
use std::path::{Path, PathBuf};

/// The folder's model, if there is one: in `sparse/0`, `colmap/sparse/0`, `sparse` or the folder itself.
pub(crate) fn find_models(folder: &Path) -> Vec<PathBuf> {
    let bases = [folder.join("sparse"), folder.join("colmap/sparse"), folder.to_owned()];
    bases.into_iter().map(|base| models_in(&base)).find(|found| !found.is_empty()).unwrap_or_default()
}

/// Model folders directly in `base` (named by numbers) and `base` itself.
pub(super) fn models_in(base: &Path) -> Vec<PathBuf> {
    let is_number =
        |p: &PathBuf| p.file_name().and_then(|n| n.to_str()).is_some_and(|n| n.parse::<u32>().is_ok());
    let entries = std::fs::read_dir(base).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut found: Vec<PathBuf> = entries.filter(is_number).collect();
    found.sort();
    found.push(base.to_owned());
    found.retain(|dir| file(dir, "cameras").is_some() && file(dir, "images").is_some());
    found
}

/// `name.bin` or else `name.txt` in a model folder.
pub(super) fn file(model: &Path, name: &str) -> Option<PathBuf> {
    ["bin", "txt"]
        .map(|extension| model.join(format!("{name}.{extension}")))
        .into_iter()
        .find(|p| p.is_file())
}

pub(super) fn is_binary(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "bin")
}

/// The images that a model poses.
pub(super) fn images(model: &Path) -> Result<Vec<Image>, DataError> {
    let path = file(model, "images").unwrap_or_default();
    match is_binary(&path) {
        true => binary::images(&path, &limits::read(&path, limits::BINARY_BYTES)?),
        false => text::images(&path, &limits::read_text(&path)?),
    }
}

/// The points of a model; none where it has no file of them.
pub(super) fn points(model: &Path) -> Result<Vec<Point>, DataError> {
    let Some(path) = file(model, "points3D") else { return Ok(Vec::new()) };
    match is_binary(&path) {
        true => binary::points(&path, &limits::read(&path, limits::BINARY_BYTES)?),
        false => text::points(&path, &limits::read_text(&path)?),
    }
}
