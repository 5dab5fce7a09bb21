//! The folder of a run that is trained: nobody else trains there meanwhile.

use crate::errors::{raised, refused};
use pyo3::prelude::*;
use refraxel::progress::Show;
use refraxel::verbs::files::create_folder;
use refraxel::verbs::train::{Lock, RunFolder};
use std::path::PathBuf;
use std::sync::Mutex;

/// The right to train in a folder, until release().
#[pyclass(frozen, module = "refraxel")]
pub struct Folder {
    path: PathBuf,
    lock: Mutex<Option<Lock>>,
}

#[pymethods]
impl Folder {
    /// Creates the folder and takes its lock; refuses one that holds a run, unless that is to be replaced.
    #[new]
    fn new(path: PathBuf, overwrite: bool) -> PyResult<Self> {
        create_folder(&path).map_err(raised)?;
        let lock = Lock::take(&path, Show::Nothing).map_err(raised)?;
        if !overwrite && RunFolder::new(&path).holds_run() {
            return Err(refused(format!(
                "{} holds a run already; choose another folder, or pass overwrite=True",
                path.display()
            )));
        }
        Ok(Self { path, lock: Mutex::new(Some(lock)) })
    }

    /// Removes the scores and curves of an earlier run.
    fn clear_scores(&self) -> PyResult<()> {
        RunFolder::new(&self.path).clear_scores().map_err(raised)
    }

    /// Lets others train there.
    fn release(&self) {
        self.lock.lock().unwrap_or_else(|e| e.into_inner()).take();
    }
}
