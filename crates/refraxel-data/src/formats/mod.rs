//! Importers: one module per file format, each from its files to a [`ParsedDataset`](crate::parsed::ParsedDataset).

pub(crate) mod colmap;
pub(crate) mod llff;
pub(crate) mod npy;
pub(crate) mod npz;
pub(crate) mod nsvf;
pub(crate) mod ply;
pub(crate) mod transforms;

use crate::DataError;
use std::path::Path;

/// The names in a folder, sorted.
pub(crate) fn names(folder: &Path) -> Result<Vec<String>, DataError> {
    let failed = |source| DataError::Read { path: folder.to_owned(), source };
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut names: Vec<String> = entries.flatten().filter_map(|e| e.file_name().into_string().ok()).collect();
    names.sort();
    Ok(names)
}

/// True for the name of an image that can be decoded.
fn is_image(name: &str) -> bool {
    let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
    ["png", "jpg", "jpeg", "exr"].contains(&extension.to_ascii_lowercase().as_str())
}
