//! What a session is made of, and what is refused before any work.

use super::SessionError;
use crate::cancel::Cancel;
use crate::detection::{Budget, Detector, Found, Hints};
use crate::events::{Event, Observer, Task};
use crate::options::{Options, StartShape, Switch};
use crate::plan::Plan;
use crate::rays::RaySampler;
use crate::refraction_search;
use crate::run::Source;
use crate::trainer::TrainingData;
use refraxel_data::{Backdrop, Dataset, IndexSource, Photo, View, check_scale, load_photo, scene_region};

/// What a session is made of.
pub struct Setup {
    /// The photographs, in files or in memory.
    pub data: Dataset,
    /// What training should do.
    pub options: Options,
    /// The index of refraction in the user's world, where somebody knows it. It is held as `shape.start = file` says.
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
    pub(super) fn check_refraction(&self, options: &Options) -> Result<(), SessionError> {
        refraction_search::check(options, refraction_search::has_masks(&self.data), self.index.as_ref())?;
        let scene = self.data.origin.to_world(scene_region(&self.data).bounds);
        let stated = options.refraction.stated_box();
        stated.map_or(Ok(()), |b| check_scale("the box `refraction.bounds`", &b, &scene))?;
        Ok(self.index.as_ref().map_or(Ok(()), |index| index.check_scale(&scene))?)
    }

    /// The options, with what a known index implies.
    pub(super) fn effective_options(&self) -> Options {
        let mut options = self.options.clone();
        if self.index.is_some() {
            (options.shape.start, options.search.enabled) = (StartShape::File, Switch::Off);
        }
        options
    }

    /// Decodes photographs, with progress.
    pub(super) fn photos(&self, observer: &mut dyn FnMut(Event)) -> Result<Vec<Photo>, SessionError> {
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
    pub(super) fn training_data(&self, photos: Vec<Photo>) -> Result<TrainingData, SessionError> {
        let views: Vec<View> = self.data.split.train.iter().map(|&i| self.data.views[i].clone()).collect();
        let validation = self.data.split.val.first().map(|&i| &self.data.views[i]);
        let validation = validation.map(|view| load_photo(view).map(|photo| (view.clone(), photo)));
        let (backdrop, origin) = (self.data.backdrop, self.data.origin);
        let index = self.index.clone().map(|index| origin.to_local(index));
        Ok(TrainingData { views, photos, backdrop, validation: validation.transpose()?, index })
    }
}
