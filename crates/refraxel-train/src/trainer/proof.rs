//! Views that nothing learns from, by which rays begin to bend and, halfway from there to the end, go on to do so.

use super::error::TrainError;
use super::start::Trainer;
use crate::events::{Event, Observer};
use crate::model::{Reflection, Refraction};
use crate::refraction_search::{baseline, proof};
use crate::schedule::{Progress, training_marching};
use crate::verdict::StayReason;

/// When bent rays are held against what straight ones had learned: after this share of the time from the decision to the end. Rays
/// that are straight again need time to learn.
const DUE: f64 = 0.5;

/// Share of the training views that is kept aside until the decision.
const ASIDE: f64 = 0.15;

/// Views that the judge keeps aside of so many; none where too few would be left to learn from.
fn views_aside(all: usize) -> usize {
    const LEAST: usize = 8;
    let wanted = (ASIDE * all as f64).round() as usize;
    if all < LEAST { 0 } else { wanted.clamp(2, 12) }
}

impl Trainer {
    /// Views that the judge needs, as the run stands.
    pub(super) fn keep_views_aside(&mut self) {
        let is_judged = self.options.judge.enabled.is_on() && self.index.is_none();
        if is_judged && (self.waits_to_bend() || self.state.baseline.is_some()) {
            self.sampler.keep_aside(views_aside(self.sampler.views()));
        }
        if !self.waits_to_bend() {
            self.hold_views_back();
        }
    }

    /// After the decision only those views stay aside that prove it.
    pub(super) fn hold_views_back(&mut self) {
        match self.state.baseline {
            Some(_) => self.sampler.give_back_but_witnesses(),
            None => self.sampler.give_back(),
        }
    }

    /// Rays have bent for half of the time that was left, and it is not known yet whether that was right.
    pub(super) fn is_proof_due(&self, now: Progress) -> bool {
        let due = |since: f64| now.0 >= since + DUE * (1.0 - since);
        self.state.baseline.is_some() && self.state.bends_since.is_some_and(due)
    }

    /// Hold bent rays against what straight ones had learned when it was decided. Where they are worse, inside masks or beside them,
    /// all rays are straight from now on.
    pub(super) fn prove_bending(&mut self, observer: &mut Observer) -> Result<(), TrainError> {
        let (views, marching) = (self.sampler.witnesses(), training_marching(&self.options, self.plan.near));
        let reached = baseline(&mut *self.backend, &views, &marching, observer.cancel())?;
        self.check_device()?;
        let Some(before) = self.state.baseline.take() else { return Ok(()) };
        self.sampler.give_back();
        let proof = proof(&before, &reached, self.progress().0);
        if let Some(verdict) = &mut self.state.verdict {
            verdict.proof = Some(proof);
        }
        self.note(Event::Proven { proof }, observer);
        if proof.is_failed() {
            self.backend.set_reflection(Reflection::none());
            self.backend.set_medium(Refraction::none());
            self.state.bends_since = None;
            self.stay_straight(StayReason::FellBehind, observer);
            self.begin_again(observer)?;
        }
        self.keep_good_state()
    }
}
