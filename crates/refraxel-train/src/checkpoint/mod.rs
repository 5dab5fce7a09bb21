//! Checkpoints: one self-contained safetensors file of named tensors and a JSON header, written atomically, verified
//! completely when read.
//!
//! Layout: the safetensors header starts with one metadata entry, a JSON envelope that holds the CRC-32 of the safetensors
//! header (computed with its own eight digits as zeros), the schema version, the CRC-32 of each tensor and the caller's
//! header. So every byte of the file is under one of the sums, and any safetensors reader opens the tensors.

mod atomic;
mod envelope;
mod faults;
mod load;
mod save;
mod tensor;

pub use atomic::{WriteError, remove_leftovers, write_atomic};
#[cfg(test)]
pub(crate) use faults::{Fault, with_fault};
pub use save::{save, write};
pub use tensor::{DataView, Rows, Tensor, TensorData, TensorFile, TensorView};

use std::path::PathBuf;

#[cfg(target_endian = "big")]
compile_error!("checkpoints are little-endian and are written straight from memory");

/// Version of the file layout described in this module.
pub const SCHEMA: u32 = 2;

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

#[cfg(test)]
mod tests;
