//! Sums of what steps did since the last record.

use crate::backend::StepOutcome;
use std::time::Instant;

/// Sums since the last record.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tally {
    squared_error: f64,
    rays: u64,
    samples: u64,
    overflows: u64,
    /// Time counted before `start` [s].
    seconds: f64,
    start: Instant,
}

impl Tally {
    pub(super) fn new() -> Self {
        Self { squared_error: 0.0, rays: 0, samples: 0, overflows: 0, seconds: 0.0, start: Instant::now() }
    }

    /// Time until [`Self::go_on`] does not count.
    pub(super) fn pause(&mut self) {
        self.seconds += self.start.elapsed().as_secs_f64();
        self.start = Instant::now();
    }

    /// Count the time from now on.
    pub(super) fn go_on(&mut self) {
        self.start = Instant::now();
    }

    pub(super) fn add(&mut self, outcome: &StepOutcome) {
        self.squared_error += outcome.squared_error;
        self.rays += outcome.rays;
        self.samples += outcome.samples;
        self.overflows += outcome.overflows;
    }

    /// Index samples that were left out.
    pub(super) fn overflows(&self) -> u64 {
        self.overflows
    }

    /// True before the first step.
    pub(super) fn is_empty(&self) -> bool {
        self.rays == 0
    }

    fn rays(&self) -> f64 {
        self.rays.max(1) as f64
    }

    /// Of the rays' colours [dB].
    pub(super) fn psnr(&self) -> f64 {
        -10.0 * (self.squared_error / (3.0 * self.rays())).log10()
    }

    pub(super) fn samples_per_ray(&self) -> f64 {
        self.samples as f64 / self.rays()
    }

    /// Thousand rays per second.
    pub(super) fn krays_per_s(&self) -> f64 {
        self.rays() / 1e3 / (self.seconds + self.start.elapsed().as_secs_f64())
    }
}
