use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file could not be written; what stood there before still stands there.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {action}: {source}; {}", path.display(), advice(source))]
pub struct WriteError {
    /// The file that was to be written.
    pub path: PathBuf,
    /// The step that failed.
    pub action: &'static str,
    /// What the system said.
    pub source: io::Error,
}

fn advice(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
            "free some space or choose another folder; an earlier file of this name is unchanged"
        }
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => {
            "choose a folder you may write to; an earlier file of this name is unchanged"
        }
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => "its folder must exist",
        _ => "an earlier file of this name is unchanged",
    }
}

/// Writes a file so that after a crash or power failure at any moment either all of it or the earlier file is there.
///
/// `fill` writes the content to a temporary file in the same folder, which is flushed to disk, renamed to `path`, and
/// the folder is flushed too. On an error the temporary file is removed.
pub fn write_atomic(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |action| move |source| WriteError { path: path.to_owned(), action, source };
    let folder = folder_of(path);
    let temporary = create_beside(path).map_err(failed("creating a temporary file in its folder"))?;
    let mut writer = BufWriter::with_capacity(1 << 20, temporary.as_file());
    fill(&mut writer).and_then(|()| writer.flush()).map_err(failed("writing its content"))?;
    drop(writer);
    temporary.as_file().sync_all().map_err(failed("flushing its content to disk"))?;
    temporary.persist(path).map_err(|e| failed("renaming the temporary file")(e.error))?;
    sync_folder(folder).map_err(failed("flushing its folder to disk"))
}

/// Removes the temporary files that killed programs left when they wrote `path`; returns how many.
///
/// Only for the one program that owns the folder: the file that another one is writing right now looks the same.
pub fn remove_leftovers(path: &Path) -> io::Result<usize> {
    let prefix = temporary_prefix(path);
    let mut removed = 0;
    for entry in fs::read_dir(folder_of(path))? {
        let entry = entry?;
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let random = name.strip_prefix(&prefix).and_then(|rest| rest.strip_suffix(SUFFIX));
        if random.is_some_and(|r| r.len() == RANDOM && r.bytes().all(|b| b.is_ascii_alphanumeric())) {
            fs::remove_file(entry.path())?;
            removed += 1;
        }
    }
    Ok(removed)
}

const SUFFIX: &str = ".tmp";
/// Random letters in the name of a temporary file.
const RANDOM: usize = 8;

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn temporary_prefix(path: &Path) -> String {
    format!(".{}.", path.file_name().unwrap_or_default().to_string_lossy())
}

fn create_beside(path: &Path) -> io::Result<NamedTempFile> {
    let prefix = temporary_prefix(path);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666)); // less the umask, as for any file
    }
    builder.tempfile_in(folder_of(path))
}

#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    fs::File::open(folder)?.sync_all()
}

#[cfg(not(unix))]
fn sync_folder(_folder: &Path) -> io::Result<()> {
    Ok(()) // folders cannot be opened for flushing; the rename is journalled by the file system
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let names = fs::read_dir(folder).unwrap();
        names.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn replaces_the_earlier_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a file.bin");
        for content in [b"first", b"later"] {
            write_atomic(&path, |w| w.write_all(content)).unwrap();
            assert_eq!(fs::read(&path).unwrap(), content);
        }
        assert_eq!(names(folder.path()), ["a file.bin"]);
    }

    #[test]
    fn full_disk_leaves_the_earlier_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.safetensors");
        fs::write(&path, "old").unwrap();
        let error = write_atomic(&path, |w| {
            w.write_all(&[7; 5000])?;
            Err(io::ErrorKind::StorageFull.into())
        })
        .unwrap_err();
        assert!(
            error.to_string().contains("run.safetensors") && error.to_string().contains("free some space")
        );
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(folder.path()), ["run.safetensors"]);
    }

    #[test]
    fn missing_folder_is_an_error_with_the_path() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("absent").join("run.safetensors");
        let error = write_atomic(&path, |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("absent") && error.to_string().contains("must exist"), "{error}");
    }

    #[test]
    fn folder_in_the_way_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::create_dir(&path).unwrap();
        let error = write_atomic(&path, |w| w.write_all(b"x")).unwrap_err();
        assert_eq!(error.action, "renaming the temporary file");
        assert_eq!(names(folder.path()), ["taken"]);
    }

    #[test]
    fn leftovers_of_this_file_only_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.st");
        write_atomic(&path, |w| w.write_all(b"x")).unwrap();
        let kept = [".other.st.aaaaaaaa.tmp", ".run.st.tmp", "notes.tmp", "run.st"];
        for name in kept.iter().chain(&[".run.st.aB3dE6gH.tmp"]) {
            fs::write(folder.path().join(name), "y").unwrap();
        }
        assert_eq!(remove_leftovers(&path).unwrap(), 1);
        let mut left = names(folder.path());
        left.sort();
        assert_eq!(left, kept);
    }

    #[test]
    fn temporary_file_counts_as_leftover() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.st");
        let mut removed = 0;
        let written = write_atomic(&path, |_| {
            removed = remove_leftovers(&path)?;
            Ok(())
        });
        assert_eq!((removed, written.is_err()), (1, true));
    }

    #[cfg(unix)]
    #[test]
    fn mode_follows_the_umask() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let mode = |name: &str| fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
        write_atomic(&folder.path().join("ours"), |_| Ok(())).unwrap();
        fs::write(folder.path().join("usual"), "").unwrap();
        assert_eq!(mode("ours"), mode("usual"));
    }
}
