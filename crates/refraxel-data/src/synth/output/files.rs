//! The files and folders of a dataset.

use super::super::error::SynthError;
use crate::atomic;
use std::fs;
use std::path::{Path, PathBuf};

pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> SynthError {
    let path = path.to_path_buf();
    move |source| SynthError::Io { action, path, source }
}

/// Writes a file that is whole or absent.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), SynthError> {
    Ok(atomic::write_atomic(path, |file| file.write_all(bytes))?)
}

/// Removes what killed programs have left in a folder of the files with such names; a missing folder is fine.
pub(super) fn remove_leftovers(folder: &Path, is_ours: impl Fn(&str) -> bool) -> Result<(), SynthError> {
    atomic::remove_leftovers(folder, is_ours).map_err(io("clear", folder))?;
    Ok(())
}

/// Creates a folder and its parents.
pub(super) fn create_folder(path: &Path) -> Result<(), SynthError> {
    fs::create_dir_all(path).map_err(io("create", path))
}

/// Removes every file of a folder (not its subfolders); a missing folder is fine.
pub(super) fn clear_folder(path: &Path) -> Result<(), SynthError> {
    for file in files_in(path)? {
        fs::remove_file(&file).map_err(io("remove", &file))?;
    }
    Ok(())
}

fn files_in(path: &Path) -> Result<Vec<PathBuf>, SynthError> {
    let entries = match fs::read_dir(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(io("read", path))?,
    };
    let mut files = Vec::new();
    for entry in entries {
        let entry = entry.map_err(io("read", path))?;
        if entry.file_type().is_ok_and(|t| t.is_file()) {
            files.push(entry.path());
        }
    }
    Ok(files)
}
