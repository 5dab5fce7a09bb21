//! Why checkpoints fail.

use super::envelope::SCHEMA;
use refraxel_data::atomic::WriteError;
use std::path::PathBuf;

/// Why a checkpoint could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file could not be opened or read.
    #[error("cannot read the checkpoint {}: {source}; name the folder that `refraxel train` was given as --out", path.display())]
    Read {
        /// The checkpoint.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is something else.
    #[error("{} is not a refraxel checkpoint: {found}; name a file that `refraxel train` wrote", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// How the file shows that it is something else.
        found: String,
    },
    /// The file is a checkpoint with bytes missing or changed.
    #[error("the checkpoint {} is damaged: {found}; restore it from a copy or use an older checkpoint of the run",
        path.display())]
    Damaged {
        /// The checkpoint.
        path: PathBuf,
        /// What does not match.
        found: String,
    },
    /// The file was written in another layout.
    #[error("the checkpoint {} has schema {found}, this program reads schema {expected}: use the refraxel that wrote it",
        path.display(), expected = SCHEMA)]
    Schema {
        /// The checkpoint.
        path: PathBuf,
        /// Its schema version.
        found: u32,
    },
    /// The file could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}
