//! Opening a dataset: find the format, let its importer read it, check and complete the result.

use crate::formats::{colmap, llff, nsvf, transforms};
use crate::parsed::ParsedDataset;
use crate::photographs::{Photographs, is_video};
use crate::{DataError, Dataset, NamedCamera, OpenOptions, assemble};
use std::path::Path;

impl Dataset {
    /// Opens a dataset folder or description file of any supported [`Format`](crate::Format).
    ///
    /// It reads descriptions and image headers, and no pixels except those of a few images with alpha. Views whose
    /// image is missing are left out with a warning in [`Dataset::problems`].
    pub fn open(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Dataset, DataError> {
        let path = path.as_ref();
        let parsed = import(path, options)?;
        assemble::assemble(path, parsed, options)
    }
}

/// Reads the cameras of a dataset whose pictures may be missing, as for new views along a path.
///
/// Sizes are those of the pictures where they exist and those that the file states elsewhere.
pub fn open_cameras(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Vec<NamedCamera>, DataError> {
    let path = path.as_ref();
    assemble::named_cameras(path, import(path, options)?)
}

fn import(path: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    if path.is_file() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        return transforms::read_single(path, options);
    }
    if !path.exists() {
        return Err(DataError::NotFound { path: path.to_owned() });
    }
    if path.join("transforms_train.json").is_file() {
        return transforms::read_blender(path, options);
    }
    let single = path.join("transforms.json");
    if single.is_file() {
        return transforms::read_single(&single, options);
    }
    let models = colmap::find_models(path);
    if !models.is_empty() {
        return colmap::read(path, &models, options);
    }
    if path.join("poses_bounds.npy").is_file() {
        return llff::read(path, options);
    }
    if let Some(poses) = nsvf::pose_folder(path) {
        return nsvf::read(path, &poses, options);
    }
    Err(without_poses(path))
}

/// Why nothing that was found has poses.
fn without_poses(path: &Path) -> DataError {
    let path = path.to_owned();
    if path.is_file() && is_video(&path) {
        return DataError::Video { path };
    }
    let found = Photographs::in_folder(&path).unwrap_or_default();
    match found.names.len() + found.unread.len() {
        0 => DataError::UnknownFormat { path },
        count => DataError::NoPoses { path, count },
    }
}
