//! Opening a dataset: find the format, let its importer read it, check and complete the result.

use crate::extensions::is_video;
use crate::folder::file_in;
use crate::formats::{colmap, llff, nsvf, recognise, transforms};
use crate::parsed::ParsedDataset;
use crate::photographs::Photographs;
use crate::{DataError, Dataset, NamedCamera, OpenOptions, assemble, below};
use std::path::Path;

impl Dataset {
    /// Opens a dataset folder or description file of any supported [`Format`](crate::Format).
    ///
    /// It reads descriptions and image headers, and the pixels of at most 12 photographs and their masks. These say
    /// what lies behind the scene, and what alpha and masks mean, where nothing else does. Views whose image is missing
    /// are left out with a warning in [`Dataset::problems`].
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
    assemble::named_cameras(path, import(path, options)?, options)
}

/// Reads a file or folder, or the only dataset in a folder below.
fn import(path: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    match import_here(path, options) {
        Err(error @ (DataError::UnknownFormat { .. } | DataError::NoPoses { .. })) => {
            let below = below::only_dataset(path, |folder| import_here(folder, options))?;
            below.ok_or_else(|| recognise::packed(path, error))
        }
        read => read,
    }
}

fn import_here(path: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    if let Some(scene) = transforms::scannetpp(path) {
        return transforms::read_scannetpp(&scene, options);
    }
    if path.is_file()
        && let Some(parsed) = recognise::read_file(path, options)?
    {
        return Ok(parsed);
    }
    if !path.exists() {
        return Err(DataError::NotFound { path: path.to_owned() });
    }
    if file_in(path, "transforms_train.json").is_some() {
        return transforms::read_blender(path, options);
    }
    if let Some(single) = file_in(path, "transforms.json") {
        return transforms::read_with_held_out(&single, options);
    }
    let models = colmap::find_models(path);
    if !models.is_empty() {
        return colmap::read(path, &models, options);
    }
    if let Some(poses) = llff::pose_file(path) {
        return llff::read(path, poses, options);
    }
    if let Some(poses) = nsvf::pose_folder(path) {
        return nsvf::read(path, &poses, options);
    }
    match recognise::read_folder(path, options)? {
        Some(parsed) => Ok(parsed),
        None => Err(without_poses(path)),
    }
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
