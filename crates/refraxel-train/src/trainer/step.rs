//! A step, and whatever is due before and after it.

use super::error::TrainError;
use super::start::Trainer;
use crate::backend::StepOutcome;
use crate::events::{Event, Observer, Task};
use crate::rays::Draw;
use crate::schedule::{Moment, Phase, Progress, in_step, objective};

/// Steps between two records of the training error.
const RECORD_EVERY: u64 = 25;
/// Parts in which the progress of a run is told.
const PARTS: u32 = 10_000;

impl Trainer {
    /// One step. The observer gets records of the log and whatever else happens. After [`TrainError::Cancelled`] the run
    /// stands between two pieces of work: the one that was under way is undone.
    pub fn step(&mut self, observer: &mut Observer) -> Result<(), TrainError> {
        if let Some(event) = self.completed.take() {
            self.note(event, observer);
        }
        if self.is_to_scout() {
            self.detect(observer)?;
        }
        let mut progress = self.scheduled();
        if self.changes(progress) && !self.settle(observer)? {
            return Ok(());
        }
        if self.stage(progress) > self.state.stage {
            self.next_stage(observer)?;
        }
        if self.is_about_to_bend(progress) {
            self.begin_bending(progress, observer)?;
            progress = self.scheduled(); // it began again if rays stay straight
        }
        if self.is_proof_due(progress) {
            self.prove_bending(observer)?;
            progress = self.scheduled(); // likewise
        }
        let (bends_since, bends) = (self.state.bends_since, self.bends());
        let is_detected = bends && self.detected.is_some();
        let moment = Moment { progress, bends_since, bends, is_detected, extent: self.plan.finest.extent };
        self.enter(moment.phase(), observer);
        self.add_clearcoat_if_due(progress, observer)?;
        self.align_if_due(moment);
        let usual = objective(&self.options, self.plan.near, moment);
        let mut objective = in_step(usual, moment, self.state.step);
        objective.scale_rates(self.state.rate_scale);
        let size = self.options.run.batch as usize;
        let (number, selection, reach) = (self.state.step, self.selection(moment), self.reach(moment));
        let draw = Draw { sampler: &self.sampler, number, size, selection, reach };
        if !self.backend.submit_drawn(&draw, &objective, number) {
            return Err(TrainError::NoPixels);
        }
        self.tell_of_drawing(observer);
        self.state.step += 1;
        let due = self.state.step.is_multiple_of(RECORD_EVERY) || self.finished();
        let outcomes = self.backend.outcomes(due);
        if self.take(&outcomes, observer)? && due {
            let mut record = self.record();
            let scored = self.validate_if_due(observer.cancel());
            record.val_psnr = *scored.as_ref().unwrap_or(&None);
            observer.tell(Event::Record(record)); // its events would else be told nowhere
            scored?;
        }
        let (done, total) = ((self.progress().0 * f64::from(PARTS)).round() as u64, PARTS.into());
        observer.tell(Event::Progress { task: Task::Training, done, total });
        Ok(())
    }

    /// Say why batches come from the host, where a device that draws them cannot.
    fn tell_of_drawing(&mut self, observer: &mut Observer) {
        let why = self.backend.why_on_host();
        if why != self.why_on_host {
            self.why_on_host.clone_from(&why);
            why.into_iter().for_each(|why| self.note(Event::DrawnOnHost { why }, observer));
        }
    }

    /// Whether the next step begins with more than drawing rays.
    fn changes(&self, progress: Progress) -> bool {
        self.stage(progress) > self.state.stage
            || self.is_about_to_bend(progress)
            || self.is_proof_due(progress)
            || self.is_clearcoat_due(progress)
    }

    /// Waits for the outcomes of all steps; false when one failed and the run went back.
    pub fn settle(&mut self, observer: &mut Observer) -> Result<bool, TrainError> {
        let outcomes = self.backend.outcomes(true);
        self.take(&outcomes, observer)
    }

    fn enter(&mut self, phase: Phase, observer: &mut Observer) {
        if phase != self.state.phase {
            self.state.phase = phase;
            self.note(Event::Phase { phase }, observer);
        }
    }

    /// Takes note of what steps have done; false when one failed and the run went back.
    fn take(&mut self, outcomes: &[StepOutcome], observer: &mut Observer) -> Result<bool, TrainError> {
        for outcome in outcomes {
            if !outcome.finite {
                self.check_device()?;
                self.roll_back(outcome.step, observer)?;
                return Ok(false);
            }
            if outcome.rays == 0 {
                return Err(TrainError::NoPixels);
            }
            self.since.add(outcome);
        }
        Ok(true)
    }
}
