//! What a run may spend on looking.

use crate::options::Options;
use std::time::Duration;

/// Most of a run that looking may take: of its time, or of its rays where it has steps.
const COST: f64 = 0.1;
/// Rays from which straight rays learn before the look, if the run has that many to spare.
const RAYS: u64 = 1_200_000;
/// Less than this part of the rays is not worth looking with.
pub(super) const LEAST: f64 = 0.25;

/// What looking may cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// Rays that are learned from.
    pub(super) rays: u64,
    /// Time, where the run has a clock.
    pub(super) time: Option<Duration>,
}

impl Budget {
    /// What a run allows, if that is enough.
    pub(crate) fn of_run(options: &Options) -> Option<Self> {
        let (run, all) = (&options.run, Self::unbounded(options).rays);
        if run.minutes > 0.0 {
            let time = Duration::from_secs_f64(60.0 * run.minutes * COST);
            return Some(Self { rays: all, time: Some(time) });
        }
        let is_stated = options.detection.rays > 0;
        let most = COST * run.steps as f64 * f64::from(run.batch);
        let rays = if is_stated { all } else { all.min(most as u64) };
        (rays as f64 >= LEAST * all as f64).then_some(Self { rays, time: None })
    }

    /// All that the options ask for.
    pub(crate) fn unbounded(options: &Options) -> Self {
        Self { rays: if options.detection.rays > 0 { options.detection.rays } else { RAYS }, time: None }
    }
}
