//! Training on the CPU and what surrounds it: backends, sampling, schedules, evaluation, image metrics, checkpoints.

pub mod backend;
pub mod bench;
pub mod checkpoint;
pub mod cpu;
pub mod evaluate;
pub mod index_edit;
pub mod index_error;
pub mod initial;
pub mod memory;
pub mod metrics;
pub mod model;
pub mod options;
pub mod polyhedron;
pub mod random;
pub mod rays;
pub mod recipe;
pub mod reflection;
pub mod refraction;
pub mod run;
pub mod schedule;
pub mod surface;
pub mod trainer;

pub use backend::Backend;
pub use cpu::CpuBackend;
pub use options::{OptionError, Options};
pub use refraction::Refraction;
pub use trainer::{TrainError, Trainer};
