//! The training loop: draw rays, let the backend learn from them, follow the schedule, watch for trouble.

mod aligning;
mod bending;
mod detecting;
mod error;
mod proof;
mod recovery;
mod tally;

pub use error::TrainError;

use crate::alignment::Alignment;
use crate::backend::{Backend, StepOutcome};
use crate::cancel::Cancel;
use crate::device::Device;
use crate::evaluation::{render, score};
use crate::events::{Event, Observer, Record, Task};
use crate::metrics::ImageScore;
use crate::model::Gate;
use crate::options::Options;
use crate::plan::{Plan, kept_bricks};
use crate::rays::{Draw, RaySampler, Selection};
use crate::refraction_search::MASK_MARGIN;
use crate::run::State;
use crate::schedule::{
    Moment, PausedSchedule, Phase, Progress, is_time_to_bend, mask_ray_fraction, objective, stage_domain,
    training_marching,
};
use recovery::Good;
use refraxel_core::BrickMap;
use refraxel_data::{Backdrop, IndexSource, Photo, View};
use std::time::Instant;
use tally::Tally;

/// Rays that decide what is pruned.
pub(crate) const PRUNING_RAYS: u64 = 600_000;
/// Every voxel has more weight than this.
const NOTHING: f32 = -1.0;
/// Least share of rays inside masks while the index learns alone.
const INDEX_INSIDE_SHARE: f64 = 0.7;
/// Steps between two records of the training error.
const RECORD_EVERY: u64 = 25;
/// Parts in which the progress of a run is told.
const PARTS: u32 = 10_000;
/// Records of the validation score in a run.
const VALIDATIONS: f64 = 20.0;

/// What a run learns from.
pub struct TrainingData {
    /// The views trained on.
    pub views: Vec<View>,
    /// Their photographs, in the same order.
    pub photos: Vec<Photo>,
    /// What lies behind.
    pub backdrop: Backdrop,
    /// A view that is looked at now and then, to see how well the run generalises.
    pub validation: Option<(View, Photo)>,
    /// The index of refraction, where somebody knows it.
    pub index: Option<IndexSource>,
}

/// A run in progress.
pub struct Trainer {
    options: Options,
    plan: Plan,
    sampler: RaySampler,
    validation: Option<(View, Photo)>,
    index: Option<IndexSource>,
    /// What masks of some views said of the others, until it is told.
    completed: Option<Event>,
    /// What was found without masks.
    detected: Option<Gate>,
    /// What the photographs themselves have learned.
    alignment: Alignment,
    backend: Box<dyn Backend>,
    state: State,
    /// The last state known to be good, to return to after an overflow.
    good: Option<Box<Good>>,
    /// Since when time counts; absent while the run pauses.
    clock: Option<Instant>,
    since: Tally,
    /// What happened since the last record.
    events: Vec<Event>,
    /// Why batches come from the host, as was told.
    why_on_host: Option<String>,
}

impl Trainer {
    /// A run that goes on from `state` with what the backend holds; [`State::default`] and [`Plan::start`] for a fresh one.
    ///
    /// # Panics
    /// If the training data has not one photo per view.
    pub fn new(
        options: Options,
        plan: Plan,
        training_data: TrainingData,
        backend: Box<dyn Backend>,
        state: State,
    ) -> Self {
        let sampler = RaySampler::new(
            training_data.views,
            training_data.photos,
            training_data.backdrop,
            options.run.seed,
        );
        let mut trainer = Self {
            completed: None,
            detected: None,
            alignment: Alignment::default(),
            options,
            plan,
            sampler,
            validation: training_data.validation,
            index: training_data.index,
            backend,
            state,
            good: None,
            clock: None,
            since: Tally::new(),
            events: Vec::new(),
            why_on_host: None,
        };
        trainer.keep_views_aside();
        trainer.completed = trainer.complete_masks();
        trainer.sampler.shift_masks(trainer.state.mask_shift);
        trainer.alignment = trainer.fresh_alignment();
        if trainer.state.step > 0 {
            // Else an overflow would start from nothing again. A device with a fault says so at the first step.
            let _ = trainer.keep_good_state();
        }
        trainer
    }

    /// The model as it is now, and who renders it.
    pub fn backend(&self) -> &dyn Backend {
        &*self.backend
    }
    /// What does not change.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }
    /// What was found without masks.
    pub fn detected(&self) -> Option<&Gate> {
        self.detected.as_ref()
    }
    /// Where the run stands.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Share of the run that is done: of the time where there is a budget, of the steps otherwise.
    pub fn progress(&self) -> Progress {
        Progress::of(&self.options, self.state.step, self.seconds())
    }

    /// Where the schedule stands. Its clock stands still while the detector looks, and while hypotheses are searched and race.
    fn scheduled(&self) -> Progress {
        self.progress().scheduled(self.state.paused)
    }

    /// The schedule goes on from where it stood. What is counted in steps takes none of them.
    fn hold_schedule(&mut self, at: Progress) {
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

    /// The last work on a run: colour in half precision. So what is rendered and scored is what the checkpoint holds.
    pub fn round_colour(&mut self) -> Result<(), TrainError> {
        self.let_go_of_good_state()?; // no step will need it
        let mut all = self.copy()?;
        all.round_colour();
        self.return_to(all);
        self.check_device()
    }

    /// The run is trained on this device from now on: in its state, and in the log with the next record.
    pub fn name_device(&mut self, device: Device) {
        self.events.push(Event::DeviceChosen { device: device.clone() });
        self.state.device = Some(device);
    }

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
        if progress.stage(&self.options) > self.state.stage {
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
        self.bake_if_due(observer)?;
        self.align_if_due(moment);
        let mut objective = objective(&self.options, self.plan.near, moment);
        objective.scale_rates(self.state.rate_scale);
        let size = self.options.run.batch as usize;
        let (number, selection) = (self.state.step, self.selection(moment));
        let draw = Draw { sampler: &self.sampler, number, size, selection };
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
        progress.stage(&self.options) > self.state.stage
            || self.is_about_to_bend(progress)
            || self.is_proof_due(progress)
            || self.is_clearcoat_due(progress)
            || self.is_bake_due()
    }

    /// Waits for the outcomes of all steps; false when one failed and the run went back.
    pub fn settle(&mut self, observer: &mut Observer) -> Result<bool, TrainError> {
        let outcomes = self.backend.outcomes(true);
        self.take(&outcomes, observer)
    }

    fn is_about_to_bend(&self, progress: Progress) -> bool {
        self.waits_to_bend() && is_time_to_bend(&self.options, self.state.step, progress)
    }

    /// Rays are straight, and will bend.
    fn waits_to_bend(&self) -> bool {
        self.bends() && self.state.bends_since.is_none()
    }

    /// Rays bend now, or will.
    fn bends(&self) -> bool {
        self.options.refraction.bend.is_on() && !self.state.stays_straight
    }

    /// Something happened that stays in the log.
    fn note(&mut self, event: Event, observer: &mut Observer) {
        self.events.push(event.clone());
        observer.tell(event);
    }

    fn enter(&mut self, phase: Phase, observer: &mut Observer) {
        if phase != self.state.phase {
            self.state.phase = phase;
            self.note(Event::Phase { phase }, observer);
        }
    }

    fn selection(&self, moment: Moment) -> Selection {
        match moment.phase() {
            _ if !moment.bends => self.straight_selection(),
            Phase::Straight => Selection::Outside(MASK_MARGIN),
            Phase::Index => {
                Selection::Inside(self.options.refraction.mask_ray_fraction.max(INDEX_INSIDE_SHARE))
            }
            Phase::Joint => Selection::Inside(mask_ray_fraction(&self.options, moment)),
        }
    }

    /// Rays that stay straight after a decision make up for the time in which they did not look inside masks.
    fn straight_selection(&self) -> Selection {
        let Some(verdict) = &self.state.verdict else { return Selection::All };
        let since = verdict.proof.map_or(verdict.progress, |proof| proof.progress);
        if since < 1.0 {
            Selection::Inside(self.sampler.mask_share() / (1.0 - since))
        } else {
            Selection::All
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

    /// A fault of the device ends the run as it was saved: what the device holds means nothing any more.
    fn check_device(&self) -> Result<(), TrainError> {
        self.backend.fault().map_or(Ok(()), |fault| Err(TrainError::Device { fault }))
    }

    /// A record of what happened since the last one, if that was more than steps: for a run that pauses.
    pub fn last_words(&mut self) -> Option<Record> {
        (!self.events.is_empty() && !self.since.is_empty()).then(|| self.record())
    }

    fn record(&mut self) -> Record {
        let tally = std::mem::replace(&mut self.since, Tally::new());
        Record {
            step: self.state.step,
            progress: self.progress().0,
            seconds: self.seconds(),
            train_psnr: tally.psnr(),
            val_psnr: None,
            resolution: self.backend.domain().resolution.into_iter().max().unwrap_or(0),
            voxels: self.backend.map().voxels() as u64,
            samples_per_ray: tally.samples_per_ray(),
            krays_per_s: tally.krays_per_s(),
            overflows: tally.overflows(),
            phase: self.state.phase,
            index: self.backend.medium().mean_indices(),
            absorption: self.backend.medium().absorption(),
            poses: self.alignment.poses.as_ref().map(|p| p.shift()),
            exposures: self.alignment.exposures.as_ref().map(|e| e.shift()),
            events: std::mem::take(&mut self.events),
        }
    }

    /// PSNR of the validation view, some times in a run; then the state counts as good, too.
    fn validate_if_due(&mut self, cancel: &Cancel) -> Result<Option<f64>, TrainError> {
        let progress = self.progress();
        if progress.0 * VALIDATIONS < f64::from(self.state.validations + 1) {
            return Ok(None);
        }
        let marching = training_marching(&self.options, self.plan.near);
        let score_of = |(view, photo): &(View, Photo)| -> Result<ImageScore, TrainError> {
            let rendering = render(&*self.backend, &view.camera, &marching, cancel)?;
            Ok(score(&rendering, view, photo, self.plan.backdrop)?)
        };
        // Of photographs that learn nothing: nobody knows the camera and the exposure of another one.
        let is_plain = !self.alignment.learns();
        let score = self.validation.as_ref().filter(|_| is_plain).map(score_of).transpose()?;
        self.state.validations = (progress.0 * VALIDATIONS) as u32;
        self.since = Tally::new();
        self.check_device()?;
        self.keep_good_state()?;
        Ok(score.map(|s| s.psnr))
    }

    /// Prune what no ray sees, if rays look where they will, and move to the next, finer grid.
    fn next_stage(&mut self, observer: &mut Observer) -> Result<(), TrainError> {
        let stage = self.scheduled().stage(&self.options);
        let marching = training_marching(&self.options, self.plan.near);
        observer.progress(Task::Pruning, 0, 2)?;
        self.backend.refresh_occupancy(&marching);
        let rays = self.sampler.spread(PRUNING_RAYS);
        let peak = self.backend.peak_weights(&rays, &marching, observer.cancel())?;
        observer.progress(Task::Pruning, 1, 2)?;
        self.let_go_of_good_state()?; // no copy on the host while two grids are alive there
        let domain = stage_domain(&self.options, &self.plan.finest, stage);
        // Straight rays never looked inside what is refractive: where they will bend they see other places.
        let least = if self.waits_to_bend() { NOTHING } else { self.options.grid.prune_weight };
        let map = kept_bricks(self.backend.map(), &peak, least, &domain);
        // A field that shows nothing yet must not lose all it could still become.
        let map = if map.bricks().is_empty() { BrickMap::dense(domain.resolution) } else { map };
        self.go_to_stage(stage, map, observer)?;
        self.keep_good_state()
    }

    /// Takes the field to the grid of a stage.
    fn go_to_stage(&mut self, stage: u32, map: BrickMap, observer: &mut Observer) -> Result<(), TrainError> {
        self.backend.resample(stage_domain(&self.options, &self.plan.finest, stage), map);
        self.backend.refresh_occupancy(&training_marching(&self.options, self.plan.near));
        self.check_device()?;
        self.state.stage = stage;
        let (resolution, voxels) = (self.backend.domain().resolution, self.backend.map().voxels() as u64);
        self.note(Event::Stage { stage, resolution, voxels }, observer);
        Ok(())
    }
}
