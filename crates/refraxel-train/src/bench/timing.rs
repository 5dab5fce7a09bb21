//! How long work takes.

use super::objective::objective;
use crate::backend::{Batch, IndexObjective, Objective, ReflectionObjective, step};
use crate::cpu::CpuBackend;
use std::time::Instant;

/// Samples of a step, and its seconds.
#[derive(Clone, Copy)]
pub(super) struct Timed {
    pub(super) samples: u64,
    pub(super) seconds: f64,
}

impl Timed {
    /// Million samples per second.
    pub(super) fn rate(self) -> f64 {
        self.samples as f64 / self.seconds / 1e6
    }
}

/// The best of `n` steps.
pub(super) fn learn(
    backend: &mut CpuBackend,
    batch: &Batch,
    n: usize,
    index: Option<IndexObjective>,
) -> Timed {
    let mut samples = 0;
    let reflection =
        index.map(|_| ReflectionObjective { rate: 1e-6, rate_strength: 1e-7, rate_clearcoat: 0.0 });
    let objective = Objective { index, reflection, ..objective() };
    let seconds = best(n, || samples = step(backend, batch, &objective, 1).samples);
    Timed { samples, seconds }
}

pub(super) fn samples_of(backend: &CpuBackend, batch: &Batch) -> u64 {
    backend.gradient_tapes(batch, &objective())
}

/// The seconds of the best of `n` repetitions, at least one.
pub(super) fn best(n: usize, work: impl FnMut()) -> f64 {
    best_within(f64::INFINITY, n, work)
}

/// The same of as many as begin within so many seconds.
pub(super) fn best_within(patience: f64, n: usize, mut work: impl FnMut()) -> f64 {
    let (begin, mut best) = (Instant::now(), f64::INFINITY);
    for _ in 0..n.max(1) {
        let start = Instant::now();
        work();
        best = best.min(start.elapsed().as_secs_f64());
        if begin.elapsed().as_secs_f64() > patience {
            break;
        }
    }
    best
}
