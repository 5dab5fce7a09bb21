//! The folder in which a dataset is made, beside the one that it becomes when everything is done.

use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::files::{create_folder, write_json};
use anyhow::Context;
use serde_json::Value;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

/// What was asked for; a work folder with another record is begun anew, and only a dataset with a record is replaced.
pub const RECORD: &str = "import.json";
/// What the programs printed.
pub const LOG: &str = "import.log";

/// `DATA.importing` beside DATA.
///
/// It stays when an import fails or is stopped: COLMAP goes on from its features and matches.
#[derive(Debug)]
pub struct WorkFolder {
    root: PathBuf,
    /// Its lock says that somebody is at work.
    lock: File,
    /// An earlier import with the same record has left something.
    pub goes_on: bool,
}

/// The work folder of a dataset.
pub fn path_for(out: &Path) -> Result<PathBuf, Failure> {
    let name = out.file_name().ok_or_else(|| {
        let text =
            format!("--out {} is not the name of a new folder; give one, such as scene", out.display());
        Exit::Usage.because(text)
    })?;
    let mut name = name.to_owned();
    name.push(".importing");
    Ok(out.with_file_name(name))
}

/// Refuses a folder that must not be replaced. Nothing is changed.
pub fn refuse_earlier(out: &Path, overwrite: bool) -> Result<(), Failure> {
    let shown = out.display();
    let text = match entries(out)? {
        names if names.is_empty() => return Ok(()),
        names if names.iter().any(|name| name == RECORD) => {
            if overwrite {
                return Ok(());
            }
            format!(
                "{shown} holds an imported dataset already; replace it by --overwrite, or choose another --out"
            )
        }
        names => format!(
            "{shown} holds files that no import wrote, such as {}; they are never removed, so choose another --out",
            names.first().map_or("", String::as_str),
        ),
    };
    Err(Exit::BadInput.because(text))
}

/// Names in a folder, sorted; none where there is no folder.
pub fn entries(folder: &Path) -> Result<Vec<String>, Failure> {
    if folder.symlink_metadata().is_err() {
        return Ok(Vec::new());
    }
    let cannot = || format!("cannot read the folder {}", folder.display());
    let read = fs::read_dir(folder).with_context(cannot).or_exit(Exit::Io)?;
    let mut names: Vec<String> =
        read.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    Ok(names)
}

impl WorkFolder {
    /// Makes the folder at `root` ready for an import that `record` describes.
    pub fn open(root: &Path, record: &Value) -> Result<Self, Failure> {
        let before = entries(root)?;
        let is_ours = before.iter().all(|name| name == LOG) || before.iter().any(|name| name == RECORD);
        if !is_ours {
            let text = format!(
                "{} holds files that no import wrote; move them or choose another --out",
                root.display()
            );
            return Err(Exit::BadInput.because(text));
        }
        create_folder(root)?;
        let lock = lock(root)?;
        let path = root.join(RECORD);
        let earlier =
            fs::read_to_string(&path).ok().and_then(|text| serde_json::from_str::<Value>(&text).ok());
        let goes_on = earlier.as_ref() == Some(record);
        if !goes_on {
            for name in before.iter().filter(|name| *name != LOG) {
                remove(&root.join(name))?;
            }
            lock.set_len(0)
                .with_context(|| format!("cannot empty {}", root.join(LOG).display()))
                .or_exit(Exit::Io)?;
            write_json(&path, record)?;
        }
        Ok(Self { root: root.to_owned(), lock, goes_on })
    }

    /// A path in the folder.
    pub fn join(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.root
    }

    /// Becomes the dataset `out`. One that stood there is removed after that.
    pub fn finish(self, out: &Path) -> Result<(), Failure> {
        drop(self.lock); // some systems do not move folders with open files
        let cannot = |from: &Path, to: &Path| format!("cannot move {} to {}", from.display(), to.display());
        let mut aside = out.file_name().unwrap_or_default().to_owned();
        aside.push(".replaced");
        let aside = out.with_file_name(aside);
        let replaces = out.symlink_metadata().is_ok();
        if replaces {
            fs::rename(out, &aside).with_context(|| cannot(out, &aside)).or_exit(Exit::Io)?;
        }
        if let Err(error) = fs::rename(&self.root, out) {
            if replaces {
                let _ = fs::rename(&aside, out); // the message names where the new dataset is
            }
            return Err(error).with_context(|| cannot(&self.root, out)).or_exit(Exit::Io);
        }
        if replaces { remove(&aside) } else { Ok(()) }
    }
}

fn lock(root: &Path) -> Result<File, Failure> {
    let path = root.join(LOG);
    let opened = OpenOptions::new().append(true).create(true).open(&path);
    let log = opened.with_context(|| format!("cannot write {}", path.display())).or_exit(Exit::Io)?;
    match log.try_lock() {
        Err(TryLockError::WouldBlock) => {
            let text = format!(
                "another import is at work in {}; wait for it or choose another --out",
                root.display()
            );
            Err(Exit::BadInput.because(text))
        }
        // A file system without locks cannot tell; that is no reason to refuse.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(log),
    }
}

/// Removes a file or a folder with all that is in it; it may be absent.
pub fn remove(path: &Path) -> Result<(), Failure> {
    let removed = match path.symlink_metadata() {
        Err(_) => return Ok(()),
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
    };
    removed.with_context(|| format!("cannot remove {}", path.display())).or_exit(Exit::Io)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_import_goes_on_only_from_what_the_same_import_has_left() {
        let folder = tempfile::tempdir().unwrap();
        let root = path_for(&folder.path().join("scene")).unwrap();
        assert!(root.ends_with("scene.importing"));
        drop(WorkFolder::open(&root, &json!({ "photographs": 3 })).unwrap());
        fs::write(root.join("features.db"), "x").unwrap();
        let again = WorkFolder::open(&root, &json!({ "photographs": 3 })).unwrap();
        assert!(again.goes_on && root.join("features.db").exists());
        let second = WorkFolder::open(&root, &json!({ "photographs": 3 })).unwrap_err();
        assert!(second.report().contains("another import is at work"));
        drop(again);
        let other = WorkFolder::open(&root, &json!({ "photographs": 4 })).unwrap();
        assert!(!other.goes_on && !root.join("features.db").exists());
    }

    #[test]
    fn files_that_no_import_wrote_stay() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("holiday.jpg"), "x").unwrap();
        for overwrite in [false, true] {
            let text = refuse_earlier(folder.path(), overwrite).unwrap_err().report();
            assert!(text.contains("holiday.jpg"), "{text}");
        }
        assert!(
            WorkFolder::open(folder.path(), &json!({})).unwrap_err().report().contains("no import wrote")
        );
        assert!(folder.path().join("holiday.jpg").exists());
    }

    #[test]
    fn a_dataset_is_replaced_only_when_asked_and_all_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("scene");
        for (round, overwrite) in [(1, false), (2, true)] {
            refuse_earlier(&out, overwrite).unwrap();
            let work = WorkFolder::open(&path_for(&out).unwrap(), &json!({ "round": round })).unwrap();
            fs::write(work.join("round"), round.to_string()).unwrap();
            work.finish(&out).unwrap();
            assert_eq!(fs::read_to_string(out.join("round")).unwrap(), round.to_string());
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        }
        assert!(refuse_earlier(&out, false).unwrap_err().report().contains("--overwrite"));
    }

    #[test]
    fn an_out_without_a_name_is_a_usage_error() {
        assert_eq!(path_for(Path::new("..")).unwrap_err().exit, Exit::Usage);
    }
}
