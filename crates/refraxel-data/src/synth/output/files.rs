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

/// At the end of the name of a file that is being written.
const TEMPORARY: &str = ".tmp";

/// Writes under a temporary name in the same folder, flushes to the disk, then renames. On an error the temporary file is removed.
pub(super) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), SynthError> {
    let mut name: OsString = path.file_name().unwrap_or_default().to_owned();
    name.push(TEMPORARY);
    let temporary = path.with_file_name(name);
    let mut file = File::create(&temporary).map_err(io("create", &temporary))?;
    // Without locks it stays behind where the program is killed, and harms nobody.
    let _ = file.try_lock();
    let written = file.write_all(bytes).and_then(|()| file.sync_all()).map_err(io("write", &temporary));
    let whole = written.and_then(|()| fs::rename(&temporary, path).map_err(io("write", path)));
    if whole.is_err() {
        let _ = fs::remove_file(&temporary);
    }
    whole
}

/// Removes the temporary files in a folder whose writers were killed, of files with such names; a missing folder is fine.
pub(super) fn remove_leftovers(folder: &Path, is_ours: impl Fn(&str) -> bool) -> Result<(), SynthError> {
    for file in files_in(folder)? {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let is_abandoned = || File::options().write(true).open(&file).is_ok_and(|f| f.try_lock().is_ok());
        if name.strip_suffix(TEMPORARY).is_some_and(&is_ours) && is_abandoned() {
            fs::remove_file(&file).map_err(io("remove", &file))?;
        }
    }
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

    #[test]
    fn a_file_that_cannot_get_its_name_leaves_no_temporary_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::create_dir(&path).unwrap();
        assert!(write_whole(&path, b"one").is_err());
        assert!(files_in(folder.path()).unwrap().is_empty());
    }

    #[test]
    fn leftovers_go_and_files_that_are_being_written_or_are_not_ours_stay() {
        let folder = tempfile::tempdir().unwrap();
        let [left, theirs, current] =
            ["r_0.png.tmp", "notes.tmp", "r_1.png.tmp"].map(|name| folder.path().join(name));
        fs::write(&left, "x").unwrap();
        fs::write(&theirs, "x").unwrap();
        let writing = File::create(&current).unwrap();
        writing.lock().unwrap();
        remove_leftovers(folder.path(), |name| name.starts_with("r_")).unwrap();
        assert_eq!([left, theirs, current].map(|path| path.exists()), [false, true, true]);
        remove_leftovers(&folder.path().join("absent"), |_| true).unwrap();
    }
}
