//! The training loop: draw rays, let the backend learn from them, follow the schedule, watch for trouble.

mod aligning;
mod bending;
mod clock;
mod detecting;
mod error;
mod good;
mod proof;
mod record;
mod recovery;
mod selection;
mod stages;
mod start;
mod step;
mod tally;

pub use error::TrainError;
pub(crate) use stages::PRUNING_RAYS;
pub use start::{Trainer, TrainingData};
