//! Where models and their files lie, and what those hold, binary or text.

use super::records::{Calibrations, Image, Images, Point};
use super::{binary, text};
use crate::folder::{file_in, folder_in, names};
use crate::{DataError, limits};
use std::collections::HashSet;
use std::path::{Path, PathBuf};

/// The folder's models, if there are some: in `sparse/0`, `colmap/sparse/0`, `sparse`, `colmap` or the folder itself, or else in folders of
/// other names in `sparse`, such as `aligned`.
pub(crate) fn find_models(folder: &Path) -> Vec<PathBuf> {
    let sparse = |folder: &Path| folder_in(folder, "sparse");
    let colmap = folder_in(folder, "colmap");
    let inner = colmap.as_deref().and_then(sparse);
    let bases = [sparse(folder), inner.clone(), colmap, Some(folder.to_owned())];
    let usual = bases.into_iter().flatten().map(|base| models_in(&base));
    let others = [sparse(folder), inner].into_iter().flatten().map(|base| models_below(&base, |_| true));
    usual.chain(others).find(|found| !found.is_empty()).unwrap_or_default()
}

/// Model folders directly in `base` (named by numbers) and `base` itself.
pub(super) fn models_in(base: &Path) -> Vec<PathBuf> {
    let mut found = models_below(base, |name| name.parse::<u32>().is_ok());
    found.extend(Some(base.to_owned()).filter(|base| is_model(base)));
    found
}

fn models_below(base: &Path, is_wanted: fn(&str) -> bool) -> Vec<PathBuf> {
    let names = names(base).unwrap_or_default().into_iter().filter(|name| is_wanted(name));
    names.map(|name| base.join(name)).filter(|folder| is_model(folder)).collect()
}

/// What is wrong where half a model lies in the place of one: `images` without `cameras`, or the other way round.
pub(crate) fn half_model(folder: &Path) -> Option<DataError> {
    let sparse = folder_in(folder, "sparse")?;
    let halves = [("images", "cameras.bin or cameras.txt"), ("cameras", "images.bin or images.txt")];
    let half = |model: PathBuf| {
        halves.into_iter().find_map(|(there, missing)| Some((file(&model, there)?, missing)))
    };
    let (path, missing) = [sparse.join("0"), sparse].into_iter().find_map(half)?;
    let (key, found) = ("the model".to_owned(), format!("incomplete: {missing} is not there"));
    Some(DataError::Value { path, key, found, expected: "all files of a model of COLMAP in one folder" })
}

fn is_model(folder: &Path) -> bool {
    file(folder, "cameras").is_some() && file(folder, "images").is_some()
}

/// `name.bin` or else `name.txt` in a model folder, in upper or lower case.
pub(super) fn file(model: &Path, name: &str) -> Option<PathBuf> {
    ["bin", "txt"].into_iter().find_map(|extension| file_in(model, &format!("{name}.{extension}")))
}

/// True where the files of a model are there in both forms, of which the text is not read.
pub(super) fn has_both(model: &Path) -> bool {
    ["bin", "txt"].iter().all(|extension| file_in(model, &format!("images.{extension}")).is_some())
}

fn is_binary(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bin"))
}

/// The images that a model poses.
pub(super) fn images(model: &Path) -> Result<Images, DataError> {
    let path = file(model, "images").unwrap_or_default();
    match is_binary(&path) {
        true => binary::images(&path, &limits::read(&path, limits::BINARY_BYTES)?),
        false => text::images(&path, &limits::read_text(&path)?),
    }
}

/// The largest number of cameras that move together; 1 where the model states no rigs, as before COLMAP 3.12.
pub(super) fn most_sensors(model: &Path) -> Result<u32, DataError> {
    let Some(path) = file(model, "rigs") else { return Ok(1) };
    match is_binary(&path) {
        true => binary::most_sensors(&path, &limits::read(&path, limits::BINARY_BYTES)?),
        false => text::most_sensors(&path, &limits::read_text(&path)?),
    }
}

/// The cameras of a model that its images use; others may be damaged.
pub(super) fn cameras(model: &Path, images: &[Image]) -> Result<Calibrations, DataError> {
    let used: HashSet<u32> = images.iter().map(|image| image.camera).collect();
    let path = file(model, "cameras").unwrap_or_default();
    match is_binary(&path) {
        true => binary::cameras(&path, &limits::read(&path, limits::BINARY_BYTES)?, &used),
        false => text::cameras(&path, &limits::read_text(&path)?, &used),
    }
}

/// The points of a model, with their tracks in the `wanted` images; none where it has no file of them.
pub(super) fn points(model: &Path, wanted: &HashSet<u32>) -> Result<Vec<Point>, DataError> {
    let Some(path) = file(model, "points3D") else { return Ok(Vec::new()) };
    match is_binary(&path) {
        true => binary::points(&path, &limits::read(&path, limits::BINARY_BYTES)?, wanted),
        false => text::points(&path, &limits::read_text(&path)?, wanted),
    }
}
