//! Training on the CPU and what surrounds it: image metrics, checkpoints.

pub mod checkpoint;
pub mod metrics;
