//! Training on the CPU and what surrounds it: backends, sampling, schedules, evaluation, image metrics, checkpoints.

pub mod alignment;
pub mod backend;
pub mod bench;
pub mod blur;
pub mod cancel;
pub mod checkpoint;
pub mod cpu;
pub mod descent;
pub mod device;
pub mod evaluation;
pub mod events;
pub mod exposures;
pub mod initial;
mod least_squares;
mod level_set;
pub mod memory;
pub mod metrics;
pub mod model;
pub mod options;
pub mod peers;
pub mod plan;
pub mod poses;
pub mod random;
pub mod rays;
pub mod recipe;
pub mod run;
pub mod schedule;
pub mod session;
pub mod trainer;
pub mod verdict;

pub use backend::Backend;
pub use cpu::CpuBackend;
pub use model::{Model, Refraction};
pub use options::{OptionError, Options};
pub use session::Session;
pub use trainer::{TrainError, Trainer};
