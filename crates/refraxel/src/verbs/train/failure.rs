//! How a session fails.

use crate::exit::{Exit, Failure};
use crate::verbs::dataset::data_failure;
use refraxel_train::TrainError;
use refraxel_train::session::SessionError;
use std::path::Path;

/// The failure of a session that starts or goes on in a run's folder.
pub(super) fn start_failure(error: SessionError, run: &Path) -> Failure {
    match error {
        SessionError::OtherViews { .. } | SessionError::OtherPhotographs => {
            Exit::BadInput.because(format!("{}: {error}", run.display()))
        }
        error => session_failure(error),
    }
}

/// The failure of a session: diverged, interrupted, or refused.
pub fn session_failure(error: SessionError) -> Failure {
    match error {
        SessionError::Data(e) => data_failure(e),
        SessionError::Train(TrainError::Diverged { .. }) => Failure::new(Exit::Numerical, error),
        SessionError::Evaluate(e) => e.into(),
        SessionError::Train(TrainError::Device { .. }) | SessionError::Backend(_) => {
            Failure::new(Exit::Device, error)
        }
        SessionError::Cancelled(_) => {
            Exit::Interrupted.because("stopped before training began; nothing was saved or changed")
        }
        _ => Failure::new(Exit::BadInput, error),
    }
}
