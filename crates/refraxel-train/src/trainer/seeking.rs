//! Looking for refractive things where no mask shows them: between looks straight rays learn the surroundings.

use super::{TrainError, Trainer};
use crate::backend::{Backend, BrickMask};
use crate::events::{Event, Watch};
use crate::model::Gate;
use crate::model::polyhedron::Plane;
use crate::options::StartShape;
use crate::recipe::{Hints, Known, LEAST_MASKS, hulls, masks, seek};
use crate::run::Looks;
use crate::schedule::{
    MOST_STRAIGHT, Progress, is_time_to_bend, is_time_to_look, stage_domain, training_marching,
};
use crate::verdict::StayReason;
use refraxel_core::Vec3;

/// How far around what was found the field is cleared [voxel of the field].
const CLEARED: f32 = 1.5;
/// The ground takes so much room above its plane [voxel of the first stage].
const GROUND: f32 = 1.2;

impl<B: Backend> Trainer<B> {
    /// Whether rays would bend if something were found that no mask shows.
    pub(super) fn seeks(&self) -> bool {
        let options = &self.options;
        let is_told =
            self.index.is_some() || options.shape.start != StartShape::Hull || self.all_are_masked();
        self.waits_to_bend() && options.seek.enabled.is_on() && !is_told
    }

    /// All views have masks of what is refractive.
    fn all_are_masked(&self) -> bool {
        self.sampler.stated() == self.sampler.views()
    }

    /// Where some views have masks and others have none, finds out which rays of the others meet the same things: until rays
    /// bend they must not learn there. What is to be told of it. Cameras are where the data put them, also in a run that goes on.
    pub(super) fn complete_masks(&mut self) -> Option<Event> {
        let (stated, views) = (self.sampler.stated(), self.sampler.views());
        if !self.options.refraction.bend.is_on() || stated == 0 || stated == views {
            return None;
        }
        let bounds = self.options.refraction.aabb().unwrap_or(self.plan.finest.bounds);
        let found = hulls(&self.sampler, &bounds);
        let is_completed = found.is_some();
        if let Some(found) = found {
            self.sampler.set_found(Some(masks(&found, &self.sampler)), false);
        }
        let pixels = self.sampler.mask_share();
        let told = Event::MasksCompleted { stated, views, needed: LEAST_MASKS, is_completed, pixels };
        Some(told).filter(|_| self.state.step == 0)
    }

    /// A look is due: the first one, or one more.
    pub(super) fn is_about_to_look(&self, progress: Progress) -> bool {
        let (options, looks) = (&self.options, self.state.looks);
        let is_time = match looks.last() {
            None => is_time_to_look(options, self.state.step, progress),
            Some(last) => self.state.step >= last + options.seek.pause || progress.0 >= MOST_STRAIGHT,
        };
        self.seeks() && looks.count < options.seek.looks && is_time
    }

    /// The moment for rays to bend has come: where something had to be found first, it is found by now.
    pub(super) fn is_time_to_bend(&self, progress: Progress) -> bool {
        if self.seeks() {
            return self.state.looks.count >= self.options.seek.looks;
        }
        is_time_to_bend(&self.options, self.state.step, progress)
    }

    /// A look at all photographs. What it finds is cleared, and rays keep clear of it from now on; where it finds nothing, rays
    /// stay straight.
    pub(super) fn look(&mut self, now: Progress, watch: &mut Watch) -> Result<(), TrainError> {
        if self.sampler.is_one_place() {
            self.stay_straight(StayReason::OnePlace, watch);
            return Ok(());
        }
        let marching = training_marching(&self.options, self.plan.near);
        self.backend.refresh_occupancy(&marching);
        let (sampler, options, near) = (&self.sampler, &self.options, self.plan.near);
        let known = Known { sampler, options, near, index: None, progress: self.progress() };
        let look = self.state.looks.count + 1;
        let seen = seek(&self.backend, &known, &self.hints(), self.sought.as_ref(), watch)?;
        let (separation, needed) = (seen.separation, self.options.seek.separation);
        let Some(found) = seen.sought else {
            self.note(Event::NothingSought { look, separation, needed }, watch);
            self.hold_schedule(now);
            return self.nothing_found(watch);
        };
        let pixels = self.go_on_with(Some(found.gate));
        self.state.looks = Looks { count: look, step: self.state.step };
        self.note(Event::Sought { look, separation, pixels }, watch);
        self.clear_found(found.ground.as_ref());
        self.hold_schedule(now);
        self.keep_good_state()?;
        Ok(())
    }

    /// What is known of where refractive things are seen: what somebody told, and the masks that there are.
    fn hints(&self) -> Hints {
        let mut hints = self.hints.clone();
        let stated = self.sampler.pictures().filter_map(|p| Some((*p.camera, p.mask()?.clone())));
        hints.within.extend(stated);
        hints
    }

    /// Rays stay straight, unless masks of some views show what is refractive: then no more is sought.
    fn nothing_found(&mut self, watch: &mut Watch) -> Result<(), TrainError> {
        if self.sampler.stated() >= LEAST_MASKS {
            self.state.looks = Looks { count: self.options.seek.looks, step: self.state.step };
        } else {
            self.go_on_with(None);
            self.stay_straight(StayReason::Unnoticed, watch);
        }
        self.keep_good_state()?;
        Ok(())
    }

    /// Take this for what is refractive; the share of the pixels that show it.
    pub fn go_on_with(&mut self, sought: Option<Gate>) -> f64 {
        let found = sought.as_ref().map(|gate| masks(std::slice::from_ref(gate), &self.sampler));
        self.sampler.set_found(found, true);
        self.sought = sought;
        self.sampler.mask_share()
    }

    /// Straight rays have filled it with haze. What it stands on stays.
    fn clear_found(&mut self, ground: Option<&Plane>) {
        let Some(gate) = &self.sought else { return };
        let voxel = self.backend.domain().voxel();
        let reach = CLEARED * voxel;
        let thickness = GROUND * stage_domain(&self.options, &self.plan.finest, 0).voxel();
        let around = |x: Vec3<f32>| {
            let beside = |a: usize, by: f32| {
                let mut x = x;
                x[a] += by;
                gate.is_inside(x)
            };
            let stands = ground.is_none_or(|p| p.height(x) > thickness);
            stands && (gate.is_inside(x) || (0..3).any(|a| beside(a, reach) || beside(a, -reach)))
        };
        let inside = BrickMask::new(self.backend.domain(), self.backend.map(), around);
        self.backend.set_density(self.options.refraction.contents_density, &inside);
        self.backend.refresh_occupancy(&training_marching(&self.options, self.plan.near));
    }
}
