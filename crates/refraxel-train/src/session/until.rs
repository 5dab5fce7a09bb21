//! How long to train, and why it ended.

use std::time::Duration;

/// How long to train. Whatever comes first ends a [`Session::run`](super::Session::run).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Until {
    /// So many steps are done, over all resumptions.
    pub step: Option<u64>,
    /// So much time has passed since the call.
    pub elapsed: Option<Duration>,
}

impl Until {
    /// Until the run has reached the end that its options state.
    pub fn finished() -> Self {
        Self::default()
    }

    /// Until so many steps are done, over all resumptions.
    pub fn step(step: u64) -> Self {
        Self { step: Some(step), ..Self::default() }
    }

    /// For so long.
    pub fn elapsed(elapsed: Duration) -> Self {
        Self { elapsed: Some(elapsed), ..Self::default() }
    }
}

/// Why a [`Session::run`](super::Session::run) ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The run has reached its end.
    Finished,
    /// What it was asked to train until is reached.
    Reached,
    /// Somebody wished to stop. The wish is fulfilled: the next call goes on.
    Cancelled,
}
