//! Why training stops early.

use crate::cancel::Cancelled;
use crate::metrics::MetricsError;
use crate::refraction_search::SearchError;

/// Why training stopped early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// The numbers overflowed again and again.
    #[error(
        "the loss became infinite or NaN at step {step} and again after {rollbacks} returns to the last good state with \
         lower learning rates; lower `field.rate_density` and `field.rate_colour`, or look for damaged images with `inspect`"
    )]
    Diverged {
        /// Step of the last failure.
        step: u64,
        /// Returns tried.
        rollbacks: u32,
    },
    /// The device on which the run was trained cannot go on.
    #[error("{fault}")]
    Device {
        /// What went wrong there, and what to do.
        fault: String,
    },
    /// No pixel may be used.
    #[error(
        "no training pixel can be used: the masks exclude all of them; check --mask-meaning (inspect shows it)"
    )]
    NoPixels,
    /// What is refractive could not be found.
    #[error(transparent)]
    Search(SearchError),
    /// A picture could not be scored.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// Somebody wished to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl From<SearchError> for TrainError {
    fn from(error: SearchError) -> Self {
        match error {
            SearchError::Cancelled(c) => Self::Cancelled(c),
            other => Self::Search(other),
        }
    }
}
