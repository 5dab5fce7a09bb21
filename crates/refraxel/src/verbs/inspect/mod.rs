//! `refraxel inspect`: describes a dataset or a run and its problems, or the GPUs of this machine.

mod data;
mod run;
mod verb;

pub use verb::run;
