//! Why a part of the data cannot be evaluated.

use crate::cancel::Cancelled;
use crate::metrics::MetricsError;
use refraxel_data::{DataError, Part};

/// Why a part cannot be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// There is nothing to evaluate.
    #[error("the data have no {part} images to evaluate; hold some out (`holdout`), or evaluate the part train", part = part.name())]
    NoViews {
        /// The part that is empty.
        part: Part,
    },
    /// A photograph cannot be used.
    #[error(transparent)]
    Data(#[from] DataError),
    /// A picture cannot be scored.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
    /// Somebody wished to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
