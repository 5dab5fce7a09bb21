//! Finished or saved runs: what they hold. What Python can do with them is in `run_methods`.

use pyo3::prelude::*;
use refraxel::verbs::loaded::Loaded;
use refraxel_train::backend::Marching;
use refraxel_train::model::{Gate, Optimiser};
use refraxel_train::run::Run as Stored;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::{Backend, CpuBackend};

/// A run at one moment: everything needed to render it or to go on.
#[pyclass(frozen, module = "refraxel")]
pub struct Run {
    pub(super) loaded: Loaded,
    detected: Option<Gate>,
    /// The cells that training skips, as the run stores them: it goes on by these, and is rendered by the latest ones.
    occupied: Vec<u64>,
}

impl Run {
    /// A run of a session or of a file.
    pub fn new(run: Stored) -> Self {
        let Stored { options, plan, state, source, model, optimiser, alignment, detected } = run;
        let marching = rendering_marching(&options, plan.near);
        let occupied = optimiser.occupied.clone();
        let mut backend = CpuBackend::resumed(model, optimiser);
        backend.refresh_occupancy(&marching);
        Self { loaded: Loaded { options, plan, state, source, alignment, backend }, detected, occupied }
    }

    /// How the run is rendered.
    pub(super) fn marching(&self) -> Marching {
        rendering_marching(&self.loaded.options, self.loaded.plan.near)
    }

    /// The run as it is stored.
    pub(super) fn stored(&self) -> Stored {
        let Loaded { options, plan, state, source, alignment, backend } = &self.loaded;
        let snapshot = backend.snapshot();
        Stored {
            options: options.clone(),
            plan: plan.clone(),
            state: state.clone(),
            source: source.clone(),
            alignment: alignment.clone(),
            model: snapshot.model.into_owned(),
            optimiser: Optimiser { occupied: self.occupied.clone(), ..snapshot.optimiser.into_owned() },
            detected: self.detected.clone(),
        }
    }
}
