//! How far a run is: its time, and where its schedule stands.

use super::start::Trainer;
use crate::schedule::{PausedSchedule, Progress};
use std::time::Instant;

impl Trainer {
    /// Share of the run that is done: of the time where there is a budget, of the steps otherwise.
    pub fn progress(&self) -> Progress {
        Progress::of(&self.options, self.state.step, self.seconds())
    }

    /// Where the schedule stands. Its clock stands still while the detector looks, and while hypotheses are searched and race.
    pub(super) fn scheduled(&self) -> Progress {
        self.progress().scheduled(self.state.paused)
    }

    /// The schedule goes on from where it stood. What is counted in steps takes none of them.
    pub(super) fn hold_schedule(&mut self, at: Progress) {
        if self.options.run.minutes > 0.0 {
            self.state.paused = Some(PausedSchedule { at: at.0, until: self.progress().0 });
        }
    }

    /// Seconds spent training, over all resumptions.
    pub fn seconds(&self) -> f64 {
        self.state.seconds + self.clock.map_or(0.0, |since| since.elapsed().as_secs_f64())
    }

    /// Time counts from now on.
    pub fn start_clock(&mut self) {
        self.clock = Some(Instant::now());
        self.since.go_on();
    }

    /// Note the time spent. Time until [`Self::start_clock`] does not count.
    pub fn pause_clock(&mut self) {
        self.state.seconds = self.seconds();
        self.clock = None;
        self.since.pause();
    }

    /// True when the run has reached its end.
    pub fn finished(&self) -> bool {
        self.progress().0 >= 1.0
    }
}
