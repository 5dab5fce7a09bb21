//! Looking for refractive things before the run where no mask shows them, and completing masks that some views have.

use super::error::TrainError;
use super::start::Trainer;
use crate::cancel::Cancelled;
use crate::detection::{self, Budget, Detector, Found, masks};
use crate::events::{Event, Observer};
use crate::model::Gate;
use crate::options::StartShape;
use crate::refraction_search::{LEAST_MASKS, hulls};
use crate::schedule::Progress;
use crate::verdict::StayReason;

impl Trainer {
    /// Whether the run is to find out first where refractive things are: rays would bend if something were found that no mask
    /// shows.
    pub(super) fn is_to_scout(&self) -> bool {
        let options = &self.options;
        let is_told =
            self.index.is_some() || options.shape.start != StartShape::Hull || self.sampler.stated() > 0;
        let is_fresh = self.state.step == 0 && !self.state.detection_done;
        is_fresh && self.waits_to_bend() && options.detection.enabled.is_on() && !is_told
    }

    /// Looks at all photographs. What is found takes the place of masks; where nothing is, rays stay straight. The schedule begins
    /// afterwards. A wish to stop leaves everything as it was.
    pub(super) fn detect(&mut self, observer: &mut Observer) -> Result<(), TrainError> {
        let mut events = Vec::new();
        let found = self.look_around(&mut events, observer)?;
        self.state.detection_done = true;
        self.events.append(&mut events);
        match found {
            Ok(Found { gate: Some(gate), .. }) => self.go_on_with(Some(gate)),
            // A box says that something is there.
            _ if self.options.refraction.stated_box().is_some() => {}
            Ok(Found { gate: None, .. }) => self.stay_straight(StayReason::Unnoticed, observer),
            Err(why) => self.stay_straight(why, observer),
        }
        self.hold_schedule(Progress(0.0));
        self.keep_good_state()?;
        Ok(())
    }

    /// Notes what happens in `events`, and tells it too.
    fn look_around(
        &self,
        events: &mut Vec<Event>,
        observer: &mut Observer,
    ) -> Result<Result<Found, StayReason>, Cancelled> {
        if self.sampler.is_one_place() {
            return Ok(Err(StayReason::OnePlace));
        }
        let Some(budget) = Budget::of_run(&self.options) else { return Ok(Err(StayReason::TooShortToLook)) };
        let detector = Detector {
            sampler: &self.sampler,
            plan: &self.plan,
            options: &self.options,
            hints: &detection::Hints::default(),
            budget,
        };
        let found = observer.noting(events, |observer| detector.look(observer))?;
        Ok(found.ok_or(StayReason::TooShortToLook))
    }

    /// Where some views have masks and others have none, finds out which rays of the others meet the same things: until rays
    /// bend they must not learn there. What is to be told of it. Cameras are where the data put them, also in a run that goes on.
    pub(super) fn complete_masks(&mut self) -> Option<Event> {
        let (stated, views) = (self.sampler.stated(), self.sampler.views());
        if !self.options.refraction.bend.is_on() || stated == 0 || stated == views {
            return None;
        }
        let bounds = self.options.refraction.local_box(self.plan.origin).unwrap_or(self.plan.finest.bounds);
        let found = hulls(&self.sampler, &bounds);
        let is_completed = found.is_some();
        if let Some(found) = found {
            self.sampler.set_found(Some(masks(&found, &self.sampler)), false);
        }
        let pixels = self.sampler.mask_share();
        let told = Event::MasksCompleted { stated, views, needed: LEAST_MASKS, is_completed, pixels };
        Some(told).filter(|_| self.state.step == 0)
    }

    /// Take this for what is refractive.
    pub fn go_on_with(&mut self, detected: Option<Gate>) {
        let found = detected.as_ref().map(|gate| masks(std::slice::from_ref(gate), &self.sampler));
        self.sampler.set_found(found, true);
        self.sampler.shift_masks(self.state.mask_shift);
        self.detected = detected;
    }
}
