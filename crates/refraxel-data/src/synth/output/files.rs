//! Files that are either whole or absent.

use super::super::error::SynthError;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> SynthError {
    let path = path.to_path_buf();
    move |source| SynthError::Io { action, path, source }
}

/// Writes under a temporary name in the same folder, flushes to the disk, then renames.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), SynthError> {
    let mut name: OsString = path.file_name().unwrap_or_default().to_owned();
    name.push(".tmp");
    let temporary = path.with_file_name(name);
    let mut file = File::create(&temporary).map_err(io("create", &temporary))?;
    file.write_all(bytes).and_then(|()| file.sync_all()).map_err(io("write", &temporary))?;
    fs::rename(&temporary, path).map_err(io("write", path))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_file_leaves_no_temporary_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write_whole(&path, b"one").unwrap();
        write_whole(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(files_in(folder.path()).unwrap(), vec![path]);
    }
}
