//! `refraxel sweep`: many runs from one plan, their table and their page.
//!
//! A run is done when it has been scored. Whoever trains it leaves a checkpoint now and then, so that the next attempt goes on
//! from there: after Ctrl-C, after a machine was lost, in another task of an array.

pub mod job;
pub mod plan;
mod processes;
pub mod results;
mod slurm;
mod verb;

pub use plan::{check_data, chosen};
pub use results::collect;
pub use verb::run;
