//! Copies of a run under way, in memory and in files.

use super::start::Session;
use crate::alignment::Alignment;
use crate::checkpoint::CheckpointError;
use crate::model::{Model, Optimiser};
use crate::run::{Run, RunRef, State};
use std::io::Write;
use std::path::Path;

impl Session {
    /// The run as it is now, without its ownership; where the device has a fault, its last good state.
    fn with_run<T>(&self, f: impl FnOnce(RunRef) -> T) -> T {
        let (options, plan, source) = (self.trainer.options(), self.trainer.plan(), &self.source);
        let detected = self.trainer.detected();
        let of = |state: &State, model: &Model, optimiser: &Optimiser, alignment: &Alignment| {
            f(RunRef { options, plan, state, source, model, optimiser, detected, alignment })
        };
        let snapshot = self.backend().snapshot();
        if self.fault().is_some() {
            return self.trainer.with_last_good(of);
        }
        of(self.state(), &snapshot.model, &snapshot.optimiser, self.trainer.alignment())
    }

    /// A copy of the run as it is now.
    pub fn snapshot(&self) -> Run {
        self.with_run(|run| run.to_owned())
    }

    /// Save the run in a folder, atomically. The time that this takes counts as time of the run. Where the device has a fault,
    /// its last good state is saved, unless what was saved before is as new.
    pub fn save(&mut self, folder: &Path) -> Result<(), CheckpointError> {
        self.trainer.start_clock();
        let saved = self.with_run(|run| {
            let step = run.state.step;
            let is_needed = step > self.saved || self.fault().is_none();
            if is_needed { run.save(folder).map(|()| step) } else { Ok(self.saved) }
        });
        self.trainer.pause_clock();
        self.saved = saved?;
        Ok(())
    }

    /// The step at which the run was saved last in a folder, or from which it goes on; 0 where there is none.
    pub fn saved_step(&self) -> u64 {
        self.saved
    }

    /// Write the same bytes anywhere; [`Run::read`] reads them.
    pub fn write(&self, to: &mut dyn Write) -> Result<(), CheckpointError> {
        self.with_run(|run| run.write(to))
    }
}
