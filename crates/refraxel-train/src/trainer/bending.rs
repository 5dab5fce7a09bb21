//! When rays begin to bend, and when things begin to mirror.

use super::error::TrainError;
use super::start::Trainer;
use crate::backend::{Backend, Caches};
use crate::cancel::Cancelled;
use crate::events::{Event, Observer};
use crate::model::{PROBE_DEGREE, ProbeLayout, Reflection};
use crate::plan::Plan;
use crate::refraction_search::{self, Context, Decision, Outline, SearchError};
use crate::schedule::{PausedSchedule, Progress, is_time_to_bend, stage_domain, training_marching};
use crate::verdict::StayReason;
use refraxel_core::ShDegree;
use refraxel_core::grid::BrickMap;
use refraxel_core::radiance::clearcoat::Clearcoat;

/// The clearcoat of opaque things: its index, the share of the run after which it is there (surfaces must be known before they can mirror),
/// and its probes along the longest edge of the scene.
const CLEARCOAT_INDEX: f32 = 1.5;
const CLEARCOAT_START: f64 = 0.15;
const CLEARCOAT_PROBES: u32 = 16;

impl Trainer {
    pub(super) fn is_about_to_bend(&self, progress: Progress) -> bool {
        self.waits_to_bend() && is_time_to_bend(&self.options, self.state.step, progress)
    }

    /// Rays are straight, and will bend.
    pub(super) fn waits_to_bend(&self) -> bool {
        self.bends() && self.state.bends_since.is_none()
    }

    /// Rays bend now, or will.
    pub(super) fn bends(&self) -> bool {
        self.options.refraction.bend.is_on() && !self.state.stays_straight
    }

    /// Find what is refractive, give it an index to start from, and let rays bend from now on.
    pub(super) fn begin_bending(&mut self, now: Progress, observer: &mut Observer) -> Result<(), TrainError> {
        self.since.pause(); // deciding is not learning
        self.good = None; // the copy made here takes its place
        let before = self.copy()?;
        let detected = self.detected.clone();
        let mut events = Vec::new();
        match self.try_to_bend(&mut events, observer) {
            Ok(Decision { stays: None, verdict, baseline }) => {
                (self.state.verdict, self.state.baseline) = (verdict, baseline);
                self.state.bends_since = Some(now.0);
                drop(before); // never three copies
                self.hold_schedule(now);
                self.hold_views_back();
            }
            Ok(Decision { stays: Some(why), verdict, .. }) => {
                // A scene without bent rays is better than none.
                drop(before);
                self.state.verdict = verdict;
                self.events.append(&mut events);
                self.stay_straight(why, observer);
                self.begin_again(observer)?;
            }
            Err(problem) => {
                if detected.is_some() {
                    self.go_on_with(detected);
                }
                self.return_to(before);
                return Err(problem.into());
            }
        }
        self.events.append(&mut events);
        self.keep_good_state()?;
        self.since.go_on();
        Ok(())
    }

    /// The schedule begins again, on the coarsest grid, with what was learned so far: straight rays have not looked inside what is
    /// refractive, and what they show there is laid out on coarse grids and high rates, as at the start of a run.
    pub(super) fn begin_again(&mut self, observer: &mut Observer) -> Result<(), TrainError> {
        let coarsest = stage_domain(&self.options, &self.plan.finest, 0);
        self.go_to_stage(0, BrickMap::dense(coarsest.resolution), observer)?;
        self.state.paused = Some(PausedSchedule { at: 0.0, until: self.progress().0 });
        Ok(())
    }

    /// Rays stay straight from now on.
    pub(super) fn stay_straight(&mut self, why: StayReason, observer: &mut Observer) {
        self.state.stays_straight = true;
        self.sampler.give_back();
        self.note(Event::RaysStayStraight { why }, observer);
    }

    /// What was found without masks ends where straight rays begin to fail, if that can be seen: not in surroundings, where they fail in
    /// many places so early.
    fn outline_found(&mut self, observer: &mut Observer) {
        if self.plan.finest.extent.is_unbounded() {
            return;
        }
        let (backend, known) = self.backend_and_context();
        let found = known.found.filter(|_| known.sampler.traces_found());
        let outline = found.and_then(|found| refraction_search::outline(backend, &known, found));
        let Some(Outline { gate, explained: [before, now] }) = outline else { return };
        self.go_on_with(Some(gate));
        observer.tell(Event::Outlined { before, now, pixels: self.sampler.mask_share() });
    }

    /// Masks end where what straight rays cannot explain does, if that can be seen.
    fn shift_masks(&mut self, observer: &mut Observer) {
        let (backend, known) = self.backend_and_context();
        let is_unknown = known.index.is_none();
        let found = is_unknown.then(|| refraction_search::border(backend, &known)).flatten();
        let Some(found) = found else { return };
        self.state.mask_shift = found.shift;
        self.sampler.shift_masks(found.shift);
        observer.tell(Event::MasksShifted {
            by: found.shift,
            inside: found.misfit[0],
            outside: found.misfit[1],
        });
    }

    /// Both at once: the search changes the backend.
    fn backend_and_context(&mut self) -> (&mut dyn Backend, Context<'_>) {
        let Plan { near, origin, .. } = self.plan;
        let (index, found, progress) = (self.index.as_ref(), self.detected.as_ref(), self.progress());
        let context =
            Context { sampler: &self.sampler, options: &self.options, near, origin, index, found, progress };
        (&mut *self.backend, context)
    }

    /// Notes what happens in `events`, and tells it too.
    fn try_to_bend(
        &mut self,
        events: &mut Vec<Event>,
        observer: &mut Observer,
    ) -> Result<Decision, SearchError> {
        self.backend.refresh_occupancy(&training_marching(&self.options, self.plan.near));
        observer.noting(events, |observer| {
            self.outline_found(observer);
            self.shift_masks(observer);
            let (backend, known) = self.backend_and_context();
            refraction_search::begin(backend, &known, observer)
        })
    }

    /// Give opaque things a clearcoat once it is time, which mirrors what the field shows by now.
    pub(super) fn add_clearcoat_if_due(
        &mut self,
        progress: Progress,
        observer: &mut Observer,
    ) -> Result<(), TrainError> {
        if !self.is_clearcoat_due(progress) {
            return Ok(());
        }
        self.good = None; // the copy made here takes its place
        let before = self.copy()?;
        if let Err(cancelled) = self.add_clearcoat(observer) {
            self.return_to(before);
            return Err(cancelled.into());
        }
        self.good = Some(Box::new(before));
        self.note(Event::ClearcoatAdded, observer);
        Ok(())
    }

    pub(super) fn is_clearcoat_due(&self, progress: Progress) -> bool {
        let c = &self.options.clearcoat;
        // The search for the index compares straight rays with bent ones, which see no clearcoat.
        c.enabled.is_on()
            && !self.waits_to_bend()
            && progress.0 >= CLEARCOAT_START
            && !self.backend.mirroring().clearcoat
    }

    fn add_clearcoat(&mut self, observer: &mut Observer) -> Result<(), Cancelled> {
        let (bounds, source) = (self.plan.finest.bounds, self.options.reflection.cache);
        let probes = |degree| ProbeLayout { longest: CLEARCOAT_PROBES, degree }.probes(bounds);
        let (strength, radiance) = (probes(ShDegree::new(0).unwrap_or_default()), probes(PROBE_DEGREE));
        let clearcoat = Clearcoat { ior: CLEARCOAT_INDEX, strength, radiance };
        if self.backend.mirroring().regions == 0 {
            self.backend.set_reflection(Reflection { source, ..Reflection::none() });
        }
        self.backend.set_clearcoat(clearcoat);
        let (backend, near) = (&mut *self.backend, self.plan.near);
        refraction_search::bake_probes(backend, Caches::Clearcoat, &self.options, near, observer)
    }
}
