//! Files that are whole at any moment: written beside their place and renamed.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A file could not be written. What stood there before still stands there, unless only its folder was not flushed.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {action}: {source}; {}", path.display(), advice(action, source))]
pub struct WriteError {
    /// The file that was to be written.
    pub path: PathBuf,
    /// The step that failed.
    pub action: &'static str,
    /// What the system said.
    pub source: io::Error,
}

/// The step after the new file has taken the place of the earlier one.
const FLUSHING_FOLDER: &str = "flushing its folder to disk";

fn advice(action: &str, source: &io::Error) -> &'static str {
    if action == FLUSHING_FOLDER {
        return "the new file is whole, but a power failure may bring the earlier one back";
    }
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
    write_atomic_with(path, || Ok(()), fill)
}

/// [`write_atomic`] with a function that is called before each request to the system: to create, write, flush, rename and flush
/// the folder. An error of it counts as the system's, so that a test can make each request fail.
pub fn write_atomic_with(
    path: &Path,
    before: fn() -> io::Result<()>,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), WriteError> {
    let failed = |action| move |source| WriteError { path: path.to_owned(), action, source };
    let created = before().and_then(|()| create_beside(path));
    let temporary = created.map_err(failed("creating a temporary file in its folder"))?;
    let mut writer = BufWriter::with_capacity(1 << 20, Temporary { file: temporary.as_file(), before });
    fill(&mut writer).and_then(|()| writer.flush()).map_err(failed("writing its content"))?;
    drop(writer);
    let flushed = before().and_then(|()| temporary.as_file().sync_all());
    flushed.map_err(failed("flushing its content to disk"))?;
    let renamed = before().and_then(|()| temporary.persist(path).map_err(io::Error::from));
    renamed.map_err(failed("renaming the temporary file"))?;
    before().and_then(|()| sync_folder(folder_of(path))).map_err(failed(FLUSHING_FOLDER))
}

/// Removes the temporary files in a folder whose writers were killed before they could, of the files with such names; returns how
/// many. A folder that is missing has none.
///
/// The file that another program is writing right now stays: it is locked. Where the file system knows no locks, all stay.
pub fn remove_leftovers(folder: &Path, is_ours: impl Fn(&str) -> bool) -> io::Result<usize> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        entries => entries?,
    };
    let mut removed = 0;
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name_of_whole(&name).is_some_and(&is_ours) && is_abandoned(&path) {
            fs::remove_file(&path)?;
            removed += 1;
        }
    }
    Ok(removed)
}

const SUFFIX: &str = ".tmp";
/// Random letters in the name of a temporary file.
const RANDOM: usize = 8;

/// The name that a temporary file gets once it is whole: NAME of `.NAME.RANDOM.tmp`.
fn name_of_whole(temporary: &str) -> Option<&str> {
    let (name, random) = temporary.strip_prefix('.')?.strip_suffix(SUFFIX)?.rsplit_once('.')?;
    let is_random = random.len() == RANDOM && random.bytes().all(|b| b.is_ascii_alphanumeric());
    (is_random && !name.is_empty()).then_some(name)
}

/// The system releases the lock of a writer that is gone.
fn is_abandoned(path: &Path) -> bool {
    OpenOptions::new().write(true).open(path).is_ok_and(|file| file.try_lock().is_ok())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

fn create_beside(path: &Path) -> io::Result<NamedTempFile> {
    let prefix = format!(".{}.", path.file_name().unwrap_or_default().to_string_lossy());
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666)); // less the umask, as for any file
    }
    let temporary = builder.tempfile_in(folder_of(path))?;
    // Without locks it stays behind where its writer is killed, and harms nobody.
    let _ = temporary.as_file().try_lock();
    Ok(temporary)
}

/// The temporary file, as it is written.
struct Temporary<'a> {
    file: &'a File,
    before: fn() -> io::Result<()>,
}

impl Write for Temporary<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Err(error) = (self.before)() {
            // As on a disk that is full: some of it is there.
            self.file.write_all(&bytes[..bytes.len() / 2])?;
            return Err(error);
        }
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
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
    fn leftovers_are_removed_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.st");
        write_atomic(&path, |w| w.write_all(b"x")).unwrap();
        let kept = [".run.st.aB3dE6g.tmp", ".run.st.tmp", "notes.aaaaaaaa.tmp", "run.st"];
        let leftovers = [".run.st.aB3dE6gH.tmp", ".log.jsonl.aaaaaaaa.tmp"];
        for name in kept.iter().chain(&leftovers) {
            fs::write(folder.path().join(name), "y").unwrap();
        }
        assert_eq!(remove_leftovers(folder.path(), |_| true).unwrap(), 2);
        let mut left = names(folder.path());
        left.sort();
        assert_eq!(left, kept);
    }

    #[test]
    fn leftovers_of_others_stay_and_a_missing_folder_has_none() {
        let folder = tempfile::tempdir().unwrap();
        let [ours, theirs] =
            [".r_0.png.aB3dE6gH.tmp", ".notes.aB3dE6gH.tmp"].map(|name| folder.path().join(name));
        fs::write(&ours, "x").unwrap();
        fs::write(&theirs, "x").unwrap();
        assert_eq!(remove_leftovers(folder.path(), |name| name == "r_0.png").unwrap(), 1);
        assert_eq!([ours, theirs].map(|path| path.exists()), [false, true]);
        assert_eq!(remove_leftovers(&folder.path().join("absent"), |_| true).unwrap(), 0);
    }

    #[test]
    fn a_file_that_is_being_written_is_no_leftover() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.st");
        let mut removed = 1;
        write_atomic(&path, |w| {
            removed = remove_leftovers(folder.path(), |_| true)?;
            w.write_all(b"x")
        })
        .unwrap();
        assert_eq!((removed, fs::read(&path).unwrap()), (0, b"x".to_vec()));
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
