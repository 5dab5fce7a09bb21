//! Devices that are refused.

use crate::exit::{Exit, Failure};
use anyhow::anyhow;

/// A device that cannot be used, or no longer.
pub(super) fn unusable(error: impl Into<anyhow::Error>) -> Failure {
    Failure::new(Exit::Device, error)
}

/// Several processes are asked for where one works.
pub(super) fn only_train() -> Failure {
    unusable(anyhow!(
        "several processes share one training, `mpirun -n N refraxel train … --device mpi`, and nothing else"
    ))
}
