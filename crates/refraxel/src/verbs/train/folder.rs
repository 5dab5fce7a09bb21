//! The folder of a run, and what an earlier run has left there.

use crate::exit::{Exit, Failure, OrExit};
use anyhow::{Context, anyhow};
use refraxel_train::checkpoint::remove_leftovers;
use refraxel_train::run::CHECKPOINT;
use std::io;
use std::path::Path;

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

    /// Where it is.
    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// Removes what killed saves have left.
    pub fn remove_leftovers(&self) {
        // Failing to do so harms nobody.
        let _ = remove_leftovers(&self.path.join(CHECKPOINT));
    }

    /// Removes the scores and curves of the run that is overwritten. Other files stay.
    pub fn clear_scores(&self) -> Result<(), Failure> {
        let eval = self.path.join("eval");
        for split in ["train", "val", "test"] {
            for folder in [split.to_owned(), format!("{split}-index")] {
                let (pictures, sheet) = (eval.join(&folder), eval.join(format!("{folder}.png")));
                removed_or_absent(&pictures, std::fs::remove_dir_all(&pictures))?;
                removed_or_absent(&sheet, std::fs::remove_file(&sheet))?;
            }
        }
        let curves = self.path.join("curves.png");
        removed_or_absent(&curves, std::fs::remove_file(&curves))
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
