//! When rays begin to bend, and when things begin to mirror.

use super::{TrainError, Trainer};
use crate::backend::{Backend, Caches};
use crate::cancel::Cancelled;
use crate::events::{Event, Task, Watch};
use crate::model::{MirrorSource, ProbeLayout, Reflection};
use crate::recipe::{self, Decision, Known, Outline, RecipeError};
use crate::schedule::{Held, Progress, stage_domain, training_marching};
use crate::verdict::StayReason;
use refraxel_core::ShDegree;
use refraxel_core::grid::BrickMap;
use refraxel_core::radiance::clearcoat::Clearcoat;

impl<B: Backend> Trainer<B> {
    /// Find what is refractive, give it an index to start from, and let rays bend from now on.
    pub(super) fn begin_bending(&mut self, now: Progress, watch: &mut Watch) -> Result<(), TrainError> {
        self.since.pause(); // deciding is not learning
        self.good = None; // the copy made here takes its place
        let before = self.copy()?;
        let sought = self.sought.clone();
        let mut events = Vec::new();
        match self.try_to_bend(&mut events, watch) {
            Ok(Decision { stays: None, verdict }) => {
                self.state.verdict = verdict;
                self.state.bends_since = Some(now.0);
                drop(before); // never three copies
                self.hold_schedule(now);
                self.sampler.give_back();
            }
            Ok(Decision { stays: Some(why), verdict }) => {
                // A scene without bent rays is better than none.
                drop(before);
                self.state.verdict = verdict;
                self.events.append(&mut events);
                self.stay_straight(why, watch);
                self.begin_again(watch)?;
            }
            Err(problem) => {
                if sought.is_some() {
                    self.go_on_with(sought);
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
    fn begin_again(&mut self, watch: &mut Watch) -> Result<(), TrainError> {
        let coarsest = stage_domain(&self.options, &self.plan.finest, 0);
        self.go_to_stage(0, BrickMap::dense(coarsest.resolution), watch)?;
        self.state.held = Some(Held { at: 0.0, until: self.progress().0 });
        Ok(())
    }

    /// Rays stay straight from now on.
    pub(super) fn stay_straight(&mut self, why: StayReason, watch: &mut Watch) {
        self.state.stays_straight = true;
        self.sampler.give_back();
        self.note(Event::RaysStayStraight { why }, watch);
    }

    /// What was found without masks ends where straight rays begin to fail, if that can be seen.
    fn outline_found(&mut self, watch: &mut Watch) -> Option<Event> {
        let found = self.sought.as_ref().filter(|_| self.sampler.traces_found())?;
        let Outline { gate, explained } = recipe::outline(&self.backend, &self.known(), found)?;
        self.go_on_with(Some(gate));
        let pixels = self.sampler.mask_share();
        let told = Event::Outlined { before: explained[0], now: explained[1], pixels };
        watch.tell(told.clone());
        Some(told)
    }

    /// Masks end where what straight rays cannot explain does, if that can be seen.
    fn shift_masks(&mut self, watch: &mut Watch) -> Option<Event> {
        let wanted = self.options.refraction.mask_shift.is_on() && self.index.is_none();
        let found = wanted.then(|| recipe::border(&self.backend, &self.known())).flatten()?;
        self.state.mask_shift = found.shift;
        self.sampler.shift_masks(found.shift);
        let told = Event::MasksShifted { by: found.shift, inside: found.misfit[0], outside: found.misfit[1] };
        watch.tell(told.clone());
        Some(told)
    }

    fn known(&self) -> Known<'_> {
        let (options, near) = (&self.options, self.plan.near);
        Known { sampler: &self.sampler, options, near, index: self.index.as_ref(), progress: self.progress() }
    }

    /// Notes what happens in `events`, and tells it too.
    fn try_to_bend(&mut self, events: &mut Vec<Event>, watch: &mut Watch) -> Result<Decision, RecipeError> {
        self.backend.refresh_occupancy(&training_marching(&self.options, self.plan.near));
        events.extend(self.outline_found(watch));
        events.extend(self.shift_masks(watch));
        let (options, near) = (&self.options, self.plan.near);
        let cancel = watch.cancel();
        let mut report = |event: Event| {
            if !matches!(event, Event::Progress { .. }) {
                events.push(event.clone());
            }
            watch.tell(event);
        };
        let (sampler, index, progress) = (&self.sampler, self.index.as_ref(), self.progress());
        let known = Known { sampler, options, near, index, progress };
        recipe::begin(&mut self.backend, &known, &mut Watch::new(cancel, &mut report))
    }

    fn bake(&mut self, caches: Caches, watch: &mut Watch) -> Result<(), Cancelled> {
        watch.progress(Task::Baking, 0, 1)?;
        let marching = training_marching(&self.options, self.plan.near);
        self.backend.bake(caches, &marching, watch.cancel())?;
        watch.tell(Event::Progress { task: Task::Baking, done: 1, total: 1 });
        Ok(())
    }

    /// Give opaque things a clearcoat once it is time, which mirrors what the field shows by now.
    pub(super) fn add_clearcoat_if_due(
        &mut self,
        progress: Progress,
        watch: &mut Watch,
    ) -> Result<(), TrainError> {
        if !self.is_clearcoat_due(progress) {
            return Ok(());
        }
        self.good = None; // the copy made here takes its place
        let before = self.copy()?;
        if let Err(cancelled) = self.add_clearcoat(watch) {
            self.return_to(before);
            return Err(cancelled.into());
        }
        self.good = Some(Box::new(before));
        self.note(Event::ClearcoatAdded, watch);
        Ok(())
    }

    pub(super) fn is_clearcoat_due(&self, progress: Progress) -> bool {
        let c = &self.options.clearcoat;
        // The search for the index compares straight rays with bent ones, which see no clearcoat.
        c.enabled.is_on()
            && !self.waits_to_bend()
            && progress.0 >= c.start
            && !self.backend.mirroring().clearcoat
    }

    fn add_clearcoat(&mut self, watch: &mut Watch) -> Result<(), Cancelled> {
        let c = &self.options.clearcoat;
        let (bounds, source) = (self.plan.finest.bounds, self.options.reflection.cache);
        let probes = |degree: u8| {
            let degree = ShDegree::new(degree).unwrap_or_default();
            ProbeLayout { longest: c.probes, degree }.probes(bounds)
        };
        let (strength, radiance) = (probes(0), probes(self.options.reflection.degree));
        let clearcoat = Clearcoat { ior: c.index, strength, radiance };
        if self.backend.mirroring().regions == 0 {
            self.backend.set_reflection(Reflection { source, ..Reflection::none() });
        }
        self.backend.set_clearcoat(clearcoat);
        if source != MirrorSource::Exact {
            self.bake(Caches::Clearcoat, watch)?;
        }
        Ok(())
    }

    /// Baked probes look at the field again.
    pub(super) fn bake_if_due(&mut self, watch: &mut Watch) -> Result<(), Cancelled> {
        if self.is_bake_due() {
            self.bake(Caches::Clearcoat, watch)?;
            self.bake(Caches::Reflection, watch)?;
        }
        Ok(())
    }

    pub(super) fn is_bake_due(&self) -> bool {
        self.state.step.is_multiple_of(self.options.reflection.bake_period)
            && self.backend.mirroring().source == MirrorSource::Baked
    }
}
