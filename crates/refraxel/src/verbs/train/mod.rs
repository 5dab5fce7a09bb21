//! `refraxel train`: from a dataset to an evaluated run.

mod arguments;
mod decide;
pub mod evidence;
mod failure;
mod folder;
mod learn;
mod lock;
mod log;
mod saving;
mod verb;
mod viewing;
mod watch;

pub use arguments::HeldOut;
pub use failure::session_failure;
pub use folder::RunFolder;
pub use lock::Lock;
pub(super) use verb::train_locked;
pub use verb::{run, train};
pub(super) use watch::ProgressDisplay;
