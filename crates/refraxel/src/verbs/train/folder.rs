//! The folder of a run, and what an earlier run has left there.

use super::evidence::EVIDENCE;
use crate::exit::{Exit, Failure, OrExit};
use anyhow::Context;
use refraxel_data::atomic::remove_leftovers;
use refraxel_train::run::CHECKPOINT;
use std::fs;
use std::io;
use std::path::Path;

/// The folder of a run.
pub struct RunFolder<'a> {
    path: &'a Path,
}

impl<'a> RunFolder<'a> {
    /// That folder, which need not be there.
    pub fn new(path: &'a Path) -> Self {
        Self { path }
    }

    /// Refuses a folder that holds a run already.
    pub fn refuse_earlier_run(&self) -> Result<(), Failure> {
        if !self.holds_run() {
            return Ok(());
        }
        Err(Exit::BadInput.because(format!(
            "{} holds a run already; continue it by --resume, replace it by --overwrite, or choose another --out",
            self.path.display()
        )))
    }

    /// Whether a run was saved there.
    pub fn holds_run(&self) -> bool {
        self.path.join(CHECKPOINT).exists()
    }

    /// Where it is.
    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// Removes what killed programs have left: parts of checkpoints, logs, pictures and scores.
    pub fn remove_leftovers(&self) {
        let eval = self.path.join("eval");
        let below = fs::read_dir(&eval).into_iter().flatten().flatten().map(|entry| entry.path());
        for folder in [self.path.to_owned(), eval.clone()].into_iter().chain(below) {
            // Failing to do so harms nobody, and not everything there is a folder.
            let _ = remove_leftovers(&folder, |_| true);
        }
    }

    /// Removes the scores and curves of the run that is overwritten. Other files stay.
    pub fn clear_scores(&self) -> Result<(), Failure> {
        let eval = self.path.join("eval");
        for split in ["train", "val", "test"] {
            for folder in [split.to_owned(), format!("{split}-index")] {
                let (pictures, sheet) = (eval.join(&folder), eval.join(format!("{folder}.png")));
                removed_or_absent(&pictures, fs::remove_dir_all(&pictures))?;
                removed_or_absent(&sheet, fs::remove_file(&sheet))?;
            }
        }
        ["curves.png", EVIDENCE].iter().try_for_each(|name| {
            let picture = self.path.join(name);
            removed_or_absent(&picture, fs::remove_file(&picture))
        })
    }
}

fn removed_or_absent(path: &Path, removed: io::Result<()>) -> Result<(), Failure> {
    match removed {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
        result => result
            .with_context(|| format!("cannot remove {} of an earlier run", path.display()))
            .or_exit(Exit::Io),
    }
}
