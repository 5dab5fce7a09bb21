//! The folder of a run, and what an earlier run has left there.

use crate::exit::{Exit, Failure, OrExit};
use anyhow::{Context, anyhow};
use refraxel_train::checkpoint::remove_leftovers;
use refraxel_train::run::CHECKPOINT;
use std::io;
use std::path::{Path, PathBuf};

/// The folder of a run.
pub struct RunFolder<'a> {
    path: &'a Path,
}

impl<'a> RunFolder<'a> {
    pub fn new(path: &'a Path) -> Self {
        Self { path }
    }

    /// Refuses a folder that holds a run already.
    pub fn refuse_earlier_run(&self) -> Result<(), Failure> {
        if !self.path.join(CHECKPOINT).exists() {
            return Ok(());
        }
        let error = anyhow!(
            "{} holds a run already; go on with it by --resume, replace it by --overwrite, or choose another --out",
            self.path.display()
        );
        Err(Failure::new(Exit::BadInput, error))
    }

    /// Removes what is not of this run: leftovers of killed saves, and unless it `resumes` the checkpoint, scores and curves
    /// of the run that is overwritten. Other files stay.
    pub fn clear(&self, resumes: bool) -> Result<(), Failure> {
        // Failing to remove leftovers harms nobody.
        let _ = remove_leftovers(&self.path.join(CHECKPOINT));
        if resumes {
            return Ok(());
        }
        for name in [CHECKPOINT, "curves.png", "eval"] {
            let path = self.path.join(name);
            let removed =
                if path.is_dir() { std::fs::remove_dir_all(&path) } else { std::fs::remove_file(&path) };
            removed_or_absent(path, removed)?;
        }
        Ok(())
    }
}

fn removed_or_absent(path: PathBuf, removed: io::Result<()>) -> Result<(), Failure> {
    match removed {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        result => result
            .with_context(|| format!("cannot remove {} of an earlier run", path.display()))
            .or_exit(Exit::Io),
    }
}
