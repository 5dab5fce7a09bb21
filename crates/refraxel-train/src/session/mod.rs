//! A run that a library user holds: open data, configure, train, watch, stop, look, save, go on.
//!
//! ```no_run
//! use refraxel_train::session::{Session, Setup, Until};
//! use refraxel_train::{CpuBackend, Options};
//! # fn train(data: refraxel_data::Dataset) -> Result<(), Box<dyn std::error::Error>> {
//! let setup = Setup::new(data, Options::default());
//! let mut session = Session::start(setup, CpuBackend::new, &mut |_| {})?;
//! session.run(Until::finished(), &mut |event| println!("{event:?}"))?;
//! # Ok(()) }
//! ```

mod error;
mod handle;
mod make;

pub use error::SessionError;
pub use handle::Handle;
pub use make::{BackendError, IntoBackend};

use crate::alignment::Alignment;
use crate::backend::Backend;
use crate::cancel::{Cancel, Cancelled};
use crate::checkpoint::CheckpointError;
use crate::detection::{Budget, Detector, Found, Hints};
use crate::device::Device;
use crate::evaluation::{EvaluateError, Evaluation, Learned, Part, Rendering, evaluate, render};
use crate::events::{Event, Observer, Task};
use crate::model::{Gate, Model, Optimiser};
use crate::options::{Options, StartShape, Switch};
use crate::plan::Plan;
use crate::rays::RaySampler;
use crate::refraction_search;
use crate::run::{Run, RunRef, Source, State};
use crate::schedule::rendering_marching;
use crate::trainer::{TrainError, Trainer, TrainingData};
use handle::Requests;
use refraxel_core::Camera;
use refraxel_data::{Backdrop, Dataset, IndexSource, Photo, View, check_scale, load_photo, scene_region};
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

/// What a session is made of.
pub struct Setup {
    /// The photographs, in files or in memory.
    pub data: Dataset,
    /// What training should do.
    pub options: Options,
    /// The index of refraction, where somebody knows it. It is held as `shape.start = file` says.
    pub index: Option<IndexSource>,
    /// Where the data come from, for the record.
    pub source: Source,
    /// A wish to stop, which holds from the first photograph on.
    pub cancel: Cancel,
}

impl Setup {
    /// Data and options, and nothing else known.
    pub fn new(data: Dataset, options: Options) -> Self {
        let source = Source::of(&data);
        Self { data, options, index: None, source, cancel: Cancel::new() }
    }

    /// Refuses what cannot lead to a result, before any work is done.
    pub fn check(&self) -> Result<(), SessionError> {
        if self.data.split.train.is_empty() {
            return Err(SessionError::NoTrainingViews);
        }
        self.options.clone().checked()?;
        if self.options.exposure.enabled.is_on() && self.data.backdrop == Backdrop::Transparent {
            return Err(SessionError::TransparentPictures);
        }
        if self.options.pose.lens.is_on() && !self.options.pose.enabled.is_on() {
            return Err(SessionError::LensWithoutPoses);
        }
        self.source.check()?;
        let options = self.effective_options();
        Plan::of_region(&options, &self.data, &scene_region(&self.data)).check()?;
        self.check_refraction(&options)
    }

    /// Looks for what is refractive without training: what straight rays do not explain, guided by hints and by the masks that some
    /// views have. Events tell of each look.
    pub fn detect(&self, hints: &Hints, observer: &mut dyn FnMut(Event)) -> Result<Found, SessionError> {
        self.check()?;
        let (options, photos) = (self.effective_options(), self.photos(observer)?);
        let plan = Plan::new(&options, &self.data, &photos);
        plan.check()?;
        let TrainingData { views, photos, backdrop, .. } = self.training_data(photos)?;
        let sampler = RaySampler::new(views, photos, backdrop, options.run.seed);
        let mut hints = hints.clone();
        let stated = sampler.pictures().filter_map(|p| Some((*p.camera, p.mask()?.clone())));
        hints.within.extend(stated);
        let budget = Budget::unbounded(&options);
        let detector = Detector { sampler: &sampler, plan: &plan, options: &options, hints: &hints, budget };
        let found = detector.look(&mut Observer::new(&self.cancel, observer))?;
        Ok(found.unwrap_or_else(|| unreachable!("no clock ends it early")))
    }

    /// Refuses what rays cannot bend by.
    fn check_refraction(&self, options: &Options) -> Result<(), SessionError> {
        refraction_search::check(options, refraction_search::has_masks(&self.data), self.index.as_ref())?;
        let scene = scene_region(&self.data).bounds;
        let stated = options.refraction.aabb().map(|b| b.cast());
        stated.map_or(Ok(()), |b| check_scale("the box `refraction.bounds`", &b, &scene))?;
        Ok(self.index.as_ref().map_or(Ok(()), |index| index.check_scale(&scene))?)
    }

    /// The options, with what a known index implies.
    fn effective_options(&self) -> Options {
        let mut options = self.options.clone();
        if self.index.is_some() {
            (options.shape.start, options.search.enabled) = (StartShape::File, Switch::Off);
        }
        options
    }

    /// Decodes photographs, with progress.
    fn photos(&self, observer: &mut dyn FnMut(Event)) -> Result<Vec<Photo>, SessionError> {
        let mut observer = Observer::new(&self.cancel, observer);
        let (all, mut photos) = (&self.data.split.train, Vec::new());
        for part in all.chunks(rayon::current_num_threads()) {
            observer.progress(Task::LoadingPhotos, photos.len() as u64, all.len() as u64)?;
            photos.extend(self.data.load_photos(part, |_| {})?);
        }
        observer.progress(Task::LoadingPhotos, photos.len() as u64, all.len() as u64)?;
        // Those that will be scored are looked at: damage is said before training and not after.
        for part in self.data.split.test.chunks(2 * rayon::current_num_threads()) {
            observer.cancel().check()?;
            self.data.load_photos(part, |_| {})?;
        }
        Ok(photos)
    }

    /// What the trainer learns from.
    fn training_data(&self, photos: Vec<Photo>) -> Result<TrainingData, SessionError> {
        let views: Vec<View> = self.data.split.train.iter().map(|&i| self.data.views[i].clone()).collect();
        let validation = self.data.split.val.first().map(|&i| &self.data.views[i]);
        let validation = validation.map(|view| load_photo(view).map(|photo| (view.clone(), photo)));
        let (backdrop, index) = (self.data.backdrop, self.index.clone());
        Ok(TrainingData { views, photos, backdrop, validation: validation.transpose()?, index })
    }
}

/// How long to train. Whatever comes first ends a [`Session::run`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Until {
    /// So many steps are done, over all resumptions.
    pub step: Option<u64>,
    /// So much time has passed since the call.
    pub elapsed: Option<Duration>,
}

impl Until {
    /// Until the run has reached the end that its options state.
    pub fn finished() -> Self {
        Self::default()
    }

    /// Until so many steps are done, over all resumptions.
    pub fn step(step: u64) -> Self {
        Self { step: Some(step), ..Self::default() }
    }

    /// For so long.
    pub fn elapsed(elapsed: Duration) -> Self {
        Self { elapsed: Some(elapsed), ..Self::default() }
    }
}

/// Why a [`Session::run`] ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The run has reached its end.
    Finished,
    /// What it was asked to train until is reached.
    Reached,
    /// Somebody wished to stop. The wish is fulfilled: the next call goes on.
    Cancelled,
}

/// A run under way.
pub struct Session {
    data: Dataset,
    source: Source,
    trainer: Trainer,
    cancel: Cancel,
    requests: Requests,
    /// The step that was saved last.
    saved: u64,
}

impl Session {
    /// Start a run: decode the photographs and plan the model; `make` gives a backend with a model, such as
    /// [`CpuBackend::new`], or says why there is none.
    pub fn start<M: IntoBackend>(
        setup: Setup,
        make: impl FnOnce(Model) -> M,
        observer: &mut dyn FnMut(Event),
    ) -> Result<Self, SessionError> {
        setup.check()?;
        let (options, photos) = (setup.effective_options(), setup.photos(observer)?);
        let plan = Plan::new(&options, &setup.data, &photos);
        plan.check()?;
        let backend = make(plan.start(&options)).into_backend().map_err(SessionError::Backend)?;
        let training_data = setup.training_data(photos)?;
        let mut trainer = Trainer::new(options, plan, training_data, backend, State::default());
        trainer.begin();
        Ok(Self::of(setup, trainer))
    }

    /// Go on with a run that was saved; `make` gives a backend with its model, such as [`CpuBackend::resumed`]. The options of
    /// the run count, except for its length, `run.minutes`, `run.steps` and `run.stop_after`, and `run.save_every`, which are those
    /// of the setup.
    pub fn resume<M: IntoBackend>(
        setup: Setup,
        run: Run,
        make: impl FnOnce(Model, Optimiser) -> M,
        observer: &mut dyn FnMut(Event),
    ) -> Result<Self, SessionError> {
        let offered = Source::of(&setup.data);
        if run.source.train != offered.train {
            let (was, found) = (run.source.train.len(), offered.train.len());
            return Err(SessionError::OtherViews { data: setup.source.name(), was, found });
        }
        if run.source.has_other_views_than(&setup.data) {
            return Err(SessionError::OtherPhotographs);
        }
        if run.state.bends_since.is_none() && !run.state.stays_straight {
            setup.check_refraction(&run.options)?;
        }
        let training_data = setup.training_data(setup.photos(observer)?)?;
        let backend = make(run.model, run.optimiser).into_backend().map_err(SessionError::Backend)?;
        let mut options = run.options;
        let length = &setup.options.run;
        (options.run.minutes, options.run.steps) = (length.minutes, length.steps);
        (options.run.stop_after, options.run.save_every) = (length.stop_after, length.save_every);
        let options = options.checked()?;
        let mut trainer = Trainer::new(options, run.plan, training_data, backend, run.state);
        trainer.go_on_with_alignment(run.alignment);
        if run.detected.is_some() {
            trainer.go_on_with(run.detected);
        }
        Ok(Self::of(setup, trainer))
    }

    fn of(setup: Setup, trainer: Trainer) -> Self {
        let Setup { data, source, cancel, .. } = setup;
        let saved = trainer.state().step;
        Self { data, source, trainer, cancel, requests: Requests::new(), saved }
    }

    /// For other threads: stops the run, and asks for copies of it while it goes on.
    pub fn handle(&self) -> Handle {
        Handle::new(self.cancel.clone(), &self.requests)
    }

    /// Train. Whatever happens is told to the observer, between steps and inside long phases.
    pub fn run(&mut self, until: Until, observer: &mut dyn FnMut(Event)) -> Result<Stop, SessionError> {
        self.trainer.start_clock();
        let stop = self.train(until, observer);
        self.trainer.pause_clock();
        self.serve_requests();
        if let Some(record) = self.trainer.last_words() {
            observer(Event::Record(record));
        }
        if let Ok(Stop::Cancelled) = stop {
            self.cancel.reset();
        }
        stop
    }

    fn train(&mut self, until: Until, observer: &mut dyn FnMut(Event)) -> Result<Stop, SessionError> {
        let start = Instant::now();
        let stop_after = Some(self.options().run.stop_after).filter(|&step| step > 0);
        let last = until.step.into_iter().chain(stop_after).min();
        loop {
            if self.requests.are_there() {
                self.trainer.settle(&mut Observer::new(&self.cancel, observer))?;
                self.trainer.pause_clock();
                self.serve_requests();
                self.trainer.start_clock();
            }
            let is_late = until.elapsed.is_some_and(|limit| start.elapsed() >= limit);
            let stop = if self.trainer.finished() {
                Some(Stop::Finished)
            } else if self.cancel.is_cancelled() {
                Some(Stop::Cancelled)
            } else {
                let is_reached = last.is_some_and(|limit| self.state().step >= limit);
                (is_late || is_reached).then_some(Stop::Reached)
            };
            let mut observer = Observer::new(&self.cancel, observer);
            if let Some(stop) = stop {
                // A step that failed is not done: the run has gone back, and goes on if it is to be finished.
                let is_done = self.trainer.settle(&mut observer)?;
                if is_done && stop == Stop::Finished {
                    self.trainer.round_colour()?;
                }
                if is_done || stop != Stop::Finished {
                    return Ok(stop);
                }
            }
            match self.trainer.step(&mut observer) {
                Ok(()) => {}
                Err(TrainError::Cancelled(_)) => self.cancel.cancel(),
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Gives copies to whoever asked for one.
    fn serve_requests(&mut self) {
        while let Some(request) = self.requests.next() {
            // Whoever asked may be gone.
            let _ = request.send(self.snapshot());
        }
    }

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

    /// Why the device cannot go on; see [`Backend::fault`]. What [`Self::snapshot`] gives is the last good state then.
    pub fn fault(&self) -> Option<String> {
        self.backend().fault()
    }

    /// The run is trained on this device from now on: in its state, and in the log with the next record.
    pub fn name_device(&mut self, device: Device) {
        self.trainer.name_device(device);
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

    /// Render and score a part of the data; `each` sees every view. Rays skip the cells that training skips, as of its last
    /// look at most 32 steps ago; [`refresh_occupancy`](Backend::refresh_occupancy) on a copy sees the latest ones too.
    pub fn evaluate(
        &self,
        part: Part,
        observer: &mut dyn FnMut(Event),
        each: &mut dyn FnMut(&View, &Rendering),
    ) -> Result<Evaluation, SessionError> {
        let marching = rendering_marching(self.trainer.options(), self.trainer.plan().near);
        let mut observer = Observer::new(&self.cancel, observer);
        let mut each = |view: &View, rendering: &Rendering, _: &_| {
            each(view, rendering);
            Ok::<(), SessionError>(())
        };
        let (backend, alignment) = (self.backend(), self.trainer.alignment());
        let learned = Learned { backend, alignment, marching: &marching };
        let found = evaluate(learned, &self.data, part, &mut observer, &mut each);
        if let Err(SessionError::Evaluate(EvaluateError::Cancelled(_))) = &found {
            self.cancel.reset();
        }
        found
    }

    /// What a camera sees, unless somebody wishes to stop.
    pub fn render(&self, camera: &Camera) -> Result<Rendering, Cancelled> {
        let marching = rendering_marching(self.trainer.options(), self.trainer.plan().near);
        let rendering = render(self.backend(), camera, &marching, &self.cancel);
        if rendering.is_err() {
            self.cancel.reset();
        }
        rendering
    }

    /// The backend, to look at the model.
    pub fn backend(&self) -> &dyn Backend {
        self.trainer.backend()
    }

    /// What was found where no mask shows it.
    pub fn detected(&self) -> Option<&Gate> {
        self.trainer.detected()
    }

    /// Where the run stands.
    pub fn state(&self) -> &State {
        self.trainer.state()
    }

    /// Its options.
    pub fn options(&self) -> &Options {
        self.trainer.options()
    }

    /// Share of the run that is done, 0 to 1.
    pub fn progress(&self) -> f64 {
        self.trainer.progress().0
    }

    /// The data.
    pub fn data(&self) -> &Dataset {
        &self.data
    }
}
