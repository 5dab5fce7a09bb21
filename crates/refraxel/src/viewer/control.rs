//! What a page may ask of the training that it shows.

use std::sync::Arc;

/// What a page may ask of a training.
pub type Control = Arc<dyn Fn(Wish) + Send + Sync>;

/// A wish of a page about the training that it shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wish {
    /// Wait, or go on.
    Pause(bool),
    /// Save and end.
    Stop,
}
