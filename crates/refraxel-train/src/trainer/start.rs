//! What a run in progress consists of, and how it starts or goes on.

use super::good::Good;
use super::tally::Tally;
use crate::alignment::Alignment;
use crate::backend::Backend;
use crate::events::Event;
use crate::model::Gate;
use crate::options::Options;
use crate::plan::Plan;
use crate::rays::RaySampler;
use crate::run::State;
use refraxel_data::{Backdrop, IndexSource, Photo, View};
use std::time::Instant;

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
    pub(super) options: Options,
    pub(super) plan: Plan,
    pub(super) sampler: RaySampler,
    pub(super) validation: Option<(View, Photo)>,
    pub(super) index: Option<IndexSource>,
    /// What masks of some views said of the others, until it is told.
    pub(super) completed: Option<Event>,
    /// What was found without masks.
    pub(super) detected: Option<Gate>,
    /// What the photographs themselves have learned.
    pub(super) alignment: Alignment,
    pub(super) backend: Box<dyn Backend>,
    pub(super) state: State,
    /// The last state known to be good, to return to after an overflow.
    pub(super) good: Option<Box<Good>>,
    /// Since when time counts; absent while the run pauses.
    pub(super) clock: Option<Instant>,
    pub(super) since: Tally,
    /// What happened since the last record.
    pub(super) events: Vec<Event>,
    /// Why batches come from the host, as was told.
    pub(super) why_on_host: Option<String>,
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
}
