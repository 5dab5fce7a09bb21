//! Going back: to the last good state after an overflow, and to where a run stood before a phase that was stopped.

use super::error::TrainError;
use super::good::Good;
use super::start::Trainer;
use crate::alignment::Alignment;
use crate::events::{Event, Observer};
use crate::model::{Model, Optimiser};
use crate::run::State;
use crate::silhouettes::{mean_colour, paint};
use refraxel_data::Backdrop;
use std::borrow::Cow;

/// Failed steps in a row after which training gives up.
const MAX_ROLLBACKS: u32 = 4;

impl Trainer {
    /// A copy of where the run stands.
    pub(super) fn copy(&self) -> Result<Good, TrainError> {
        self.copy_over(None)
    }

    /// The same in the memory of a copy that is not needed any more.
    fn copy_over(&self, old: Option<Good>) -> Result<Good, TrainError> {
        let snapshot = self.backend.snapshot();
        self.check_device()?;
        let (model, optimiser) = match (snapshot.model, snapshot.optimiser, old) {
            (Cow::Borrowed(model), Cow::Borrowed(optimiser), Some(old)) => old.copied(model, optimiser),
            (model, optimiser, _) => (model.into_owned(), optimiser.into_owned()),
        };
        Ok(Good { state: self.state.clone(), model, optimiser, alignment: self.alignment.clone() })
    }

    /// The model that the run begins with.
    fn beginning(&self) -> Model {
        let mut model = self.plan.start(&self.options);
        if self.plan.backdrop == Backdrop::Surroundings
            && let Some(colour) = mean_colour(self.sampler.pictures())
        {
            paint(&mut model, colour);
        }
        model
    }

    /// A fresh run: from now on the backend, which holds [`Plan::start`](crate::plan::Plan::start), holds the model that the run
    /// begins with.
    pub(crate) fn begin(&mut self) {
        if self.plan.backdrop == Backdrop::Surroundings {
            self.backend.load(self.beginning(), None);
        }
    }

    /// Stand where a copy was made.
    pub(super) fn return_to(&mut self, good: Good) {
        self.backend.load(good.model, Some(good.optimiser));
        self.go_on_with_alignment(good.alignment);
        self.state = State { seconds: self.state.seconds, ..good.state };
        self.sampler.shift_masks(self.state.mask_shift);
    }

    pub(super) fn keep_good_state(&mut self) -> Result<(), TrainError> {
        self.check_device()?;
        // At most one copy at a time, unless it is needed should the device fail.
        let old = if self.backend.may_fail() { None } else { self.good.take() };
        self.good = Some(Box::new(self.copy_over(old.map(|good| *good))?));
        self.state.rollbacks = 0;
        Ok(())
    }

    /// Give up the last good state, whose memory is needed; keep where the run stands where it would be lost with its device.
    pub(super) fn let_go_of_good_state(&mut self) -> Result<(), TrainError> {
        if self.backend.may_fail() {
            return self.keep_good_state();
        }
        self.good = None;
        Ok(())
    }

    /// The last good state, or else the beginning: what is left of the run after a fault of its device.
    pub(crate) fn with_last_good<T>(&self, f: impl FnOnce(&State, &Model, &Optimiser, &Alignment) -> T) -> T {
        if let Some(good) = &self.good {
            return f(&good.state, &good.model, &good.optimiser, &good.alignment);
        }
        let model = self.beginning();
        let state = State { seconds: self.state.seconds, ..State::default() };
        f(&state, &model, &Optimiser::new(&model), &self.alignment.forgotten())
    }

    /// Stand at the last good state, or else at the beginning.
    fn go_back(&mut self) {
        match self.good.take() {
            Some(good) => self.return_to(*good),
            None => {
                self.backend.load(self.beginning(), None);
                self.go_on_with_alignment(self.alignment.forgotten());
                self.state = State { seconds: self.state.seconds, ..State::default() };
                self.sampler.shift_masks(self.state.mask_shift);
            }
        }
    }

    /// Return to the last good state with half the learning rates, and draw other rays from there on. A run that gives up stands at
    /// that state, too: whoever keeps it gets nothing of the step that failed.
    pub(super) fn roll_back(&mut self, failed: u64, observer: &mut Observer) -> Result<(), TrainError> {
        let (step, rollbacks) = (self.state.step, self.state.rollbacks + 1);
        let rate_scale = 0.5 * self.state.rate_scale;
        self.go_back();
        if rollbacks > MAX_ROLLBACKS {
            return Err(TrainError::Diverged { step: failed, rollbacks: rollbacks - 1 });
        }
        self.state.step = step;
        self.keep_good_state()?;
        (self.state.rollbacks, self.state.rate_scale) = (rollbacks, rate_scale);
        self.note(Event::RolledBack { step: failed, rate_scale }, observer);
        Ok(())
    }

    /// The last work on a run: colour in half precision. So what is rendered and scored is what the checkpoint holds.
    pub fn round_colour(&mut self) -> Result<(), TrainError> {
        self.let_go_of_good_state()?; // no step will need it
        let mut all = self.copy()?;
        all.round_colour();
        self.return_to(all);
        self.check_device()
    }

    /// A fault of the device ends the run as it was saved: what the device holds means nothing any more.
    pub(super) fn check_device(&self) -> Result<(), TrainError> {
        self.backend.fault().map_or(Ok(()), |fault| Err(TrainError::Device { fault }))
    }
}
