//! A moment of training.

use crate::model::{Model, Optimiser};
use std::borrow::Cow;

/// A model and the state of its optimiser at one moment; borrowed where the backend's memory is the host's.
#[derive(Clone, Debug)]
pub struct Snapshot<'a> {
    /// The parameters.
    pub model: Cow<'a, Model>,
    /// Moments and occupied cells.
    pub optimiser: Cow<'a, Optimiser>,
}
