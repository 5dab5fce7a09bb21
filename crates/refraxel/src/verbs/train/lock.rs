//! One training at a time in the folder of a run: RUN/training.lock.
//!
//! The file is locked, not merely there: the system releases a lock however its holder ends, so one that can be taken has no
//! living holder, whatever the file says. The text only tells people who holds it. Nobody who reads a run looks at it.

use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::interrupts;
use anyhow::Context;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Name of the file in the folder of a run.
pub const LOCK: &str = "training.lock";

/// Longest text of the file [byte]; a longer one says nothing.
const LONGEST: u64 = 4096;

/// The right to train in a folder, until this is dropped.
#[derive(Debug)]
pub struct Lock {
    path: PathBuf,
    /// Holds the lock; absent where the file system has none.
    file: Option<File>,
}

/// Who trains in a folder.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct Holder {
    pid: u32,
    host: String,
    /// When it began [s since 1970].
    since: u64,
}

impl Lock {
    /// Takes the lock of a run. One whose holder is gone is taken over, and a line says so.
    pub fn take(run: &Path, show: Show) -> Result<Self, Failure> {
        Self::attempt(run, show)?.map_err(|holder| refused(run, holder.as_ref()))
    }

    /// The same; within, who holds it if somebody else does, as far as that is known.
    pub fn attempt(run: &Path, show: Show) -> Result<Result<Self, Option<Holder>>, Failure> {
        let path = run.join(LOCK);
        let unusable = || {
            format!(
                "cannot write {}; make room there, or choose an --out that you may write to",
                path.display()
            )
        };
        loop {
            let mut file = open(&path).with_context(unusable).or_exit(Exit::Io)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(Err(Holder::read(&mut file))),
                Err(TryLockError::Error(error)) => {
                    let path = path.display();
                    show.say(&format!(
                        "note: {path} cannot be locked ({error}); nothing keeps a second training out of the folder"
                    ));
                    return Ok(Ok(Self { path: PathBuf::new(), file: None }));
                }
            }
            if !is_at(&file, &path) {
                continue; // its holder has removed it meanwhile
            }
            if let Some(gone) = Holder::read(&mut file) {
                let run = run.display();
                show.say(&format!("note: {gone} trained in {run} and is gone; its lock is taken over"));
            }
            let written = Holder::this().write(&mut file);
            let lock = Self { path: path.clone(), file: Some(file) }; // is removed where it cannot be written
            written.with_context(unusable).or_exit(Exit::Io)?;
            interrupts::holds(Some(&path));
            return Ok(Ok(lock));
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if self.file.is_some() {
            // While it is locked: afterwards it may be that of another training.
            let _ = fs::remove_file(&self.path);
            interrupts::holds(None);
        }
    }
}

fn open(path: &Path) -> io::Result<File> {
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
}

fn refused(run: &Path, holder: Option<&Holder>) -> Failure {
    let holder = holder.map_or_else(|| "another process".to_owned(), ToString::to_string);
    let (run, path) = (run.display(), run.join(LOCK));
    Exit::BadInput.because(format!(
        "{holder} trains in {run} (its lock is {}); wait until it has ended, stop it, or choose another --out",
        path.display()
    ))
}

/// Whether the file still has this name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let same = |a: &fs::Metadata, b: &fs::Metadata| (a.dev(), a.ino()) == (b.dev(), b.ino());
    matches!((file.metadata(), fs::metadata(path)), (Ok(a), Ok(b)) if same(&a, &b))
}

#[cfg(not(unix))]
fn is_at(_file: &File, path: &Path) -> bool {
    path.exists() // an open file cannot be replaced there
}

impl Holder {
    fn this() -> Self {
        Self { pid: std::process::id(), host: host(), since: now() }
    }

    fn read(file: &mut File) -> Option<Self> {
        let mut text = String::new();
        file.take(LONGEST).read_to_string(&mut text).ok()?;
        serde_json::from_str(&text).ok()
    }

    fn write(&self, file: &mut File) -> io::Result<()> {
        file.set_len(0)?;
        file.rewind()?;
        file.write_all(serde_json::to_string(self)?.as_bytes())
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let minutes = now().saturating_sub(self.since) / 60;
        write!(f, "process {} on {}, which began {minutes} minutes ago,", self.pid, self.host)
    }
}

fn now() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |t| t.as_secs())
}

fn host() -> String {
    let told = fs::read_to_string("/proc/sys/kernel/hostname").ok();
    let named = || ["HOSTNAME", "COMPUTERNAME"].into_iter().find_map(|name| std::env::var(name).ok());
    told.or_else(named).map_or_else(|| "an unknown host".to_owned(), |name| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_training_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let first = Lock::take(folder.path(), Show::Nothing).unwrap();
        let failure = Lock::take(folder.path(), Show::Nothing).unwrap_err();
        let (exit, text) = (failure.exit, failure.report());
        assert_eq!(exit, Exit::BadInput);
        let pid = format!("process {} on ", std::process::id());
        assert!(
            text.contains(&pid) && text.contains(LOCK) && text.contains("choose another --out"),
            "{text}"
        );
        drop(first);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "nothing stays");
        Lock::take(folder.path(), Show::Nothing).unwrap();
    }

    #[test]
    fn a_lock_that_was_left_behind_or_is_damaged_is_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(LOCK);
        let gone = Holder { pid: std::process::id(), host: "elsewhere".into(), since: 1 };
        for text in [serde_json::to_string(&gone).unwrap(), "x".repeat(5000)] {
            fs::write(&path, text).unwrap();
            let lock = Lock::take(folder.path(), Show::Nothing).unwrap();
            assert_eq!(Holder::read(&mut File::open(&path).unwrap()).unwrap().host, host());
            drop(lock);
        }
    }

    #[test]
    fn a_lock_that_is_removed_while_one_waits_for_it_is_no_lock() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(LOCK);
        let file = open(&path).unwrap();
        assert!(is_at(&file, &path));
        fs::remove_file(&path).unwrap();
        assert!(!is_at(&file, &path));
        let _other = open(&path).unwrap();
        assert!(!is_at(&file, &path));
    }
}
