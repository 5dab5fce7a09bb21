//! `refraxel render`: renders new views of a run.

mod camera_path;
mod cameras;
pub(crate) mod depth;
mod film;
mod folder;
pub(crate) mod paths;
pub(crate) mod refractive;
mod report;
mod slices;
mod verb;
mod views;
mod writing;

pub use cameras::intrinsics;
pub use verb::run;
