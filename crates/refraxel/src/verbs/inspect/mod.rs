//! `refraxel inspect`: describes a dataset or a run and its problems, or the GPUs of this machine.

mod compared;
mod contact;
mod data;
mod doubt;
mod from_above;
mod look;
mod measures;
mod names;
mod of_cameras;
mod of_photographs;
mod palette;
mod per_view;
mod pictures;
mod run;
mod same;
mod statistics;
mod verb;
mod views;

pub use verb::run;
