//! A model under way: what a trial starts from, and what it has learned.

use crate::backend::Backend;
use crate::model::{Model, Optimiser};

/// A model under way.
#[derive(Clone)]
pub(super) struct State {
    model: Model,
    optimiser: Optimiser,
}

impl State {
    /// What a backend holds.
    pub(super) fn of(backend: &dyn Backend) -> Self {
        let snapshot = backend.snapshot();
        Self { model: snapshot.model.into_owned(), optimiser: snapshot.optimiser.into_owned() }
    }

    /// Puts it into a backend.
    pub(super) fn load(self, backend: &mut dyn Backend) {
        backend.load(self.model, Some(self.optimiser));
    }
}
