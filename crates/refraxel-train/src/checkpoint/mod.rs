//! Checkpoints: one self-contained safetensors file of named tensors and a JSON header, written atomically, verified
//! completely when read.
//!
//! Layout: the safetensors header starts with one metadata entry, a JSON envelope that holds the CRC-32 of the safetensors
//! header (computed with its own eight digits as zeros), the schema version, the CRC-32 of each tensor and the caller's
//! header. So every byte of the file is under one of the sums, and any safetensors reader opens the tensors.

mod envelope;
mod error;
mod faults;
mod load;
mod save;
mod tensor;
#[cfg(test)]
mod tests;

pub use envelope::SCHEMA;
pub use error::CheckpointError;
#[cfg(test)]
pub(crate) use faults::{Fault, with_fault};
pub use save::{save, write};
pub use tensor::{Rows, Tensor, TensorData, TensorFile};
