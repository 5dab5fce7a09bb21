//! What can be wrong with a dataset. Each message says which file and key, what was found, what
//! was expected, and what to do.

mod dataset;
mod memory;

pub use dataset::DataError;
pub use memory::{MemoryError, ViewFault};
