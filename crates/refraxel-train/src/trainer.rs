//! The training loop: sample rays, let the backend learn from them, follow the schedule, watch for trouble.

use crate::backend::{Backend, StepOutcome};
use crate::checkpoint::CheckpointError;
use crate::cpu::CpuBackend;
use crate::evaluate::{render, score};
use crate::metrics::MetricsError;
use crate::model::{Plan, kept_bricks};
use crate::options::{Options, Switch};
use crate::rays::{RaySampler, Selection};
use crate::recipe::{self, RecipeError};
use crate::reflection::{MirrorSource, ProbeLayout, Reflection};
use crate::run::State;
use crate::schedule::{
    Moment, Phase, Progress, is_time_to_bend, mask_ray_fraction, objective_of, stage_domain,
    training_marching,
};
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{BrickMap, ShDegree};
use refraxel_data::{Dataset, Photo, View};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Rays that decide what is pruned.
const PRUNING_RAYS: u64 = 600_000;
/// Least share of rays inside masks while the index learns alone.
const INDEX_MASK_RAY_FRACTION: f64 = 0.7;
/// Rays that say whether what is refractive has a surface.
const RAYS_FOR_SURFACES: usize = 256;
/// Steps between two records of the training error.
const RECORD_EVERY: u64 = 25;
/// Records of the validation score in a run.
const VALIDATIONS: f64 = 20.0;
/// Failed steps in a row after which training gives up.
const MAX_ROLLBACKS: u32 = 4;

/// One line of the training log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Steps done.
    pub step: u64,
    /// Share of the run that is done.
    pub progress: f64,
    /// Seconds spent training, over all resumptions.
    pub seconds: f64,
    /// PSNR of the training rays since the last record [dB].
    pub train_psnr: f64,
    /// PSNR of a validation view [dB], where one was rendered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub val_psnr: Option<f64>,
    /// Nodes along the longest edge.
    pub resolution: u32,
    /// Stored voxels.
    pub voxels: u64,
    /// Samples shaded per ray.
    pub samples_per_ray: f64,
    /// Thousand rays per second since the last record.
    pub krays_per_s: f64,
    /// What the run is busy with.
    #[serde(default, alias = "act")]
    pub phase: Phase,
    /// Mean index of refraction where it is above 1, per region.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub index: Vec<f64>,
    /// What happened since the last record, in sentences.
    #[serde(default, alias = "news", skip_serializing_if = "Vec::is_empty")]
    pub events: Vec<String>,
}

/// Why training stopped early.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// The numbers overflowed again and again.
    #[error(
        "the loss became infinite or NaN at step {step} and again after {rollbacks} returns to the last good state with \
         lower learning rates; lower `rate_density` and `rate_colour`, or look for damaged images with `inspect`"
    )]
    Diverged {
        /// Step of the last failure.
        step: u64,
        /// Rollbacks tried.
        rollbacks: u32,
    },
    /// No pixel may be used.
    #[error(
        "no training pixel can be used: the masks exclude all of them; check --mask-meaning (inspect shows it)"
    )]
    NoPixels,
    /// What is refractive could not be found.
    #[error(transparent)]
    Recipe(#[from] RecipeError),
    /// A checkpoint could not be read or written.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// A picture could not be scored.
    #[error(transparent)]
    Metrics(#[from] MetricsError),
}

/// A run in progress.
pub struct Trainer {
    options: Options,
    plan: Plan,
    sampler: RaySampler,
    validation: Option<(View, Photo)>,
    backend: CpuBackend,
    state: State,
    /// The last state known to be good, to return to after an overflow.
    good: Option<Box<Saved>>,
    clock: Instant,
    since: Tally,
    events: Vec<String>,
}

/// What a rollback restores.
struct Saved {
    state: State,
    backend: CpuBackend,
}

/// Sums since the last record.
#[derive(Clone, Copy, Debug)]
struct Tally {
    squared_error: f64,
    rays: u64,
    samples: u64,
    start: Instant,
}

impl Tally {
    fn new() -> Self {
        Self { squared_error: 0.0, rays: 0, samples: 0, start: Instant::now() }
    }
}

impl Trainer {
    /// A fresh run on the training photographs of a dataset; `validation` is looked at now and then.
    pub fn new(
        options: Options,
        data: &Dataset,
        photos: Vec<Photo>,
        validation: Option<(View, Photo)>,
    ) -> Self {
        let plan = Plan::new(&options, data, &photos);
        let backend = plan.start(&options);
        Self::resumed(options, plan, backend, State::default(), (data, photos, validation))
    }

    /// A run that goes on from a checkpoint.
    pub fn resumed(
        options: Options,
        plan: Plan,
        backend: CpuBackend,
        state: State,
        (data, photos, validation): (&Dataset, Vec<Photo>, Option<(View, Photo)>),
    ) -> Self {
        let views = data.split.train.iter().map(|&i| data.views[i].clone()).collect();
        let sampler = RaySampler::new(views, photos, data.backdrop, options.run.seed);
        let mut trainer = Self {
            options,
            plan,
            sampler,
            validation,
            backend,
            state,
            good: None,
            clock: Instant::now(),
            since: Tally::new(),
            events: Vec::new(),
        };
        if trainer.state.step > 0 {
            trainer.keep_good_state(); // else an overflow would start from nothing again
        }
        trainer
    }

    /// The model as it is now.
    pub fn backend(&self) -> &CpuBackend {
        &self.backend
    }
    /// What does not change.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }
    /// The options.
    pub fn options(&self) -> &Options {
        &self.options
    }
    /// Where the run stands.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Share of the run that is done: of the time where there is a budget, of the steps otherwise.
    pub fn progress(&self) -> Progress {
        if self.options.run.minutes > 0.0 {
            Progress((self.seconds() / (60.0 * self.options.run.minutes)).min(1.0))
        } else {
            Progress(self.state.step as f64 / self.options.run.steps as f64)
        }
    }

    /// Seconds spent training, over all resumptions.
    pub fn seconds(&self) -> f64 {
        self.state.seconds + self.clock.elapsed().as_secs_f64()
    }

    /// Note the time spent, before saving.
    pub fn settle_clock(&mut self) {
        self.state.seconds = self.seconds();
        self.clock = Instant::now();
    }

    /// True when the run has reached its end.
    pub fn finished(&self) -> bool {
        self.progress().0 >= 1.0
    }

    /// One step; a record of the log when one is due.
    pub fn step(&mut self) -> Result<Option<Record>, TrainError> {
        let progress = self.progress();
        if progress.stage(&self.options) > self.state.stage {
            self.next_stage();
        }
        if self.state.bends_since.is_none() && is_time_to_bend(&self.options, self.state.step, progress) {
            self.begin_bending()?;
        }
        let phase = progress.phase(&self.options, self.state.bends_since);
        self.state.phase = phase;
        let moment = Moment { progress, bends_since: self.state.bends_since.unwrap_or(0.0) };
        let mut objective = objective_of(&self.options, self.plan.near, moment, phase);
        objective.rate_density *= self.state.rate_scale;
        objective.rate_colour *= self.state.rate_scale;
        objective.rate_background *= self.state.rate_scale;
        if let Some(index) = &mut objective.index {
            index.rate *= self.state.rate_scale;
            index.surface_rate *= self.state.rate_scale;
        }
        if let Some(reflection) = &mut objective.reflection {
            reflection.rate *= self.state.rate_scale;
            reflection.rate_strength *= self.state.rate_scale;
            reflection.rate_clearcoat *= self.state.rate_scale;
        }
        self.clearcoat_if_due(progress);
        self.bake_if_due();
        let batch = self.sampler.batch(
            self.state.step,
            self.options.run.batch as usize,
            self.selection(phase, moment),
        );
        if batch.rays.is_empty() {
            return Err(TrainError::NoPixels);
        }
        let outcome = self.backend.learn(&batch, &objective, self.state.step);
        if !outcome.finite {
            self.roll_back()?;
            return Ok(None);
        }
        self.state.step += 1;
        self.count(&outcome, batch.rays.len() as u64);
        let due = self.state.step.is_multiple_of(RECORD_EVERY) || self.finished();
        Ok(if due { Some(self.record()?) } else { None })
    }

    fn selection(&self, phase: Phase, moment: Moment) -> Selection {
        match phase {
            _ if self.options.refraction.bend == Switch::Off => Selection::All,
            Phase::Straight => Selection::Outside,
            Phase::Index => {
                Selection::Inside(self.options.refraction.mask_ray_fraction.max(INDEX_MASK_RAY_FRACTION))
            }
            Phase::Joint => Selection::Inside(mask_ray_fraction(&self.options, moment)),
        }
    }

    /// Find what is refractive, give it an index to start from, and let rays bend from now on.
    fn begin_bending(&mut self) -> Result<(), TrainError> {
        let marching = training_marching(&self.options, self.plan.near);
        self.good = None;
        self.backend.refresh_occupancy(&marching);
        match recipe::begin(&mut self.backend, &self.sampler, &self.options, self.plan.near) {
            Ok(events) => {
                self.events.extend(events);
                self.begin_reflecting();
                self.state.bends_since = Some(self.progress().0); // the search took its time
            }
            Err(problem @ RecipeError::Locate(_)) => {
                // A scene without bent rays is better than none.
                self.events.push(format!("rays stay straight: {problem}"));
                self.options.refraction.bend = Switch::Off;
            }
            Err(problem) => return Err(problem.into()),
        }
        self.keep_good_state();
        Ok(())
    }

    /// Let surfaces mirror what the field shows by now, where there are some: a lens has none.
    fn begin_reflecting(&mut self) {
        let c = &self.options;
        if !c.reflection.enabled.is_on() || !self.has_surfaces() {
            return;
        }
        let degree = ShDegree::new(c.reflection.degree).unwrap_or_default();
        let layout = ProbeLayout { longest: c.reflection.probes, degree };
        self.backend.set_reflection(Reflection::of(self.backend.refraction(), c.reflection.cache, &layout));
        if c.reflection.cache != MirrorSource::Exact {
            self.backend.bake_reflection(&training_marching(c, self.plan.near));
        }
    }

    /// Something refractive has a sharp surface, or transitions that most rays through it meet.
    fn has_surfaces(&self) -> bool {
        let (refraction, domain) = (self.backend.refraction(), &self.backend.field().domain);
        let is_sharp = refraction.medium.regions().iter().any(|r| r.level_set().is_some());
        let rays = || self.sampler.batch(0, RAYS_FOR_SURFACES, Selection::Inside(1.0)).rays;
        is_sharp || refraction.mirrors(&rays(), domain)
    }

    /// ClearcoatReflection opaque things once it is time, with what the field shows by now.
    fn clearcoat_if_due(&mut self, progress: Progress) {
        let c = &self.options;
        // The search for the index compares straight rays with bent ones, which see no clearcoat.
        let waits = c.refraction.bend == Switch::On && self.state.bends_since.is_none();
        if !c.clearcoat.enabled.is_on()
            || waits
            || progress.0 < c.clearcoat.start
            || self.backend.clearcoat().is_some()
        {
            return;
        }
        let bounds = self.plan.finest.bounds;
        let probes = |degree: u8| {
            let degree = ShDegree::new(degree).unwrap_or_default();
            ProbeLayout { longest: c.clearcoat.probes, degree }.probes(bounds)
        };
        let (strength, radiance) = (probes(0), probes(c.reflection.degree));
        if self.backend.reflection().is_none() {
            let source = self.options.reflection.cache;
            self.backend.set_reflection(Reflection { source, ..Reflection::none() });
        }
        self.backend.set_clearcoat(Clearcoat { ior: c.clearcoat.index, strength, radiance });
        if self.options.reflection.cache != MirrorSource::Exact {
            self.backend.bake_clearcoat(&training_marching(&self.options, self.plan.near));
        }
        self.events.push("opaque things have a clearcoat that mirrors".to_owned());
    }

    /// Baked probes look at the field again.
    fn bake_if_due(&mut self) {
        let due = self.state.step.is_multiple_of(self.options.reflection.bake_period);
        if due && self.backend.reflection().source == MirrorSource::Baked {
            let marching = training_marching(&self.options, self.plan.near);
            self.backend.bake_clearcoat(&marching);
            self.backend.bake_reflection(&marching);
        }
    }

    fn count(&mut self, outcome: &StepOutcome, rays: u64) {
        self.since.squared_error += outcome.squared_error;
        self.since.rays += rays;
        self.since.samples += outcome.samples;
    }

    fn record(&mut self) -> Result<Record, TrainError> {
        let progress = self.progress();
        let tally = std::mem::replace(&mut self.since, Tally::new());
        let rays = tally.rays.max(1) as f64;
        let mut record = Record {
            step: self.state.step,
            progress: progress.0,
            seconds: self.seconds(),
            train_psnr: -10.0 * (tally.squared_error / (3.0 * rays)).log10(),
            val_psnr: None,
            resolution: self.backend.field().domain.resolution.into_iter().max().unwrap_or(0),
            voxels: self.backend.field().map.voxels() as u64,
            samples_per_ray: tally.samples as f64 / rays,
            krays_per_s: rays / 1e3 / tally.start.elapsed().as_secs_f64(),
            phase: self.state.phase,
            index: self.backend.refraction().mean_indices(),
            events: std::mem::take(&mut self.events),
        };
        if progress.0 * VALIDATIONS >= f64::from(self.state.validations + 1) {
            self.state.validations = (progress.0 * VALIDATIONS) as u32;
            record.val_psnr = self.validate()?;
            self.since = Tally::new();
            self.keep_good_state();
        }
        Ok(record)
    }

    /// PSNR of the validation view.
    fn validate(&mut self) -> Result<Option<f64>, TrainError> {
        let Some((view, photo)) = self.validation.take() else { return Ok(None) };
        let marching = training_marching(&self.options, self.plan.near);
        let rendering = render(&self.backend, &view.camera, &marching);
        let psnr = score(&rendering, &view, &photo, self.plan.backdrop)?.psnr;
        self.validation = Some((view, photo));
        Ok(Some(psnr))
    }

    /// Prune what no ray sees and move to the next, finer grid.
    fn next_stage(&mut self) {
        let stage = self.progress().stage(&self.options);
        let marching = training_marching(&self.options, self.plan.near);
        self.good = None; // no copy while two grids are alive
        self.backend.refresh_occupancy(&marching);
        let peak = self.backend.peak_weights(&self.sampler.spread(PRUNING_RAYS), &marching);
        let domain = stage_domain(&self.options, &self.plan.finest, stage);
        let map = kept_bricks(self.backend.field(), &peak, self.options.grid.prune_weight, &domain);
        // A field that shows nothing yet must not lose all it could still become.
        let map = if map.bricks().is_empty() { BrickMap::dense(domain.resolution) } else { map };
        self.backend.resample(domain, map);
        self.backend.refresh_occupancy(&marching);
        self.state.stage = stage;
        self.keep_good_state();
    }

    fn keep_good_state(&mut self) {
        self.good = None; // at most one copy at a time
        let mut backend = CpuBackend::with_moments(
            self.backend.field().clone(),
            self.backend.background().clone(),
            self.backend.moments().clone(),
        );
        backend.restore_refraction(self.backend.refraction().clone(), self.backend.moments().index.clone());
        let moments = self.backend.moments().reflection.clone();
        backend.restore_reflection(self.backend.reflection().clone(), moments);
        backend
            .restore_clearcoat(self.backend.clearcoat().cloned(), self.backend.moments().clearcoat.clone());
        self.good = Some(Box::new(Saved { state: self.state.clone(), backend }));
        self.state.rollbacks = 0;
    }

    /// Return to the last good state with half the learning rates, and draw other rays from there on.
    fn roll_back(&mut self) -> Result<(), TrainError> {
        let (step, rollbacks) = (self.state.step, self.state.rollbacks + 1);
        if rollbacks > MAX_ROLLBACKS {
            return Err(TrainError::Diverged { step, rollbacks: rollbacks - 1 });
        }
        let rate_scale = 0.5 * self.state.rate_scale;
        match self.good.take() {
            Some(saved) => {
                self.backend = saved.backend;
                self.state = State { step, seconds: self.state.seconds, ..saved.state };
            }
            None => {
                self.backend = self.plan.start(&self.options);
                self.state = State { step, seconds: self.state.seconds, ..State::default() };
            }
        }
        self.keep_good_state();
        self.state.step += 1;
        self.state.rollbacks = rollbacks;
        self.state.rate_scale = rate_scale;
        Ok(())
    }
}
