//! The run that writes a dataset.

mod description;
mod photographs;
mod plan;
mod renderings;
mod run;

pub use run::{Progress, Summary, synthesize};
