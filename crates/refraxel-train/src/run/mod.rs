//! What a run stores: one self-contained checkpoint with everything needed to render it or to go on training.

mod boxes;
mod clearcoat;
mod contents;
mod detected;
mod field;
mod header;
mod load;
mod projection;
mod reflection;
mod refraction;
mod save;
mod source;
mod state;
mod tensors;
#[cfg(test)]
mod tests;
mod views;

pub use contents::{Run, RunRef};
pub use save::CHECKPOINT;
pub use source::{PathNotText, Read, Source, check_path};
pub use state::State;
pub use tensors::nearest_half;
