//! Training on the CPU and what surrounds it: backends, image metrics, checkpoints.

pub mod backend;
pub mod bench;
pub mod checkpoint;
pub mod cpu;
pub mod metrics;
pub mod random;

pub use backend::Backend;
pub use cpu::CpuBackend;
