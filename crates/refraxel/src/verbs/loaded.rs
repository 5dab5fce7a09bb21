//! A run that was read back, with a backend that renders it.

use crate::exit::Failure;
use refraxel_train::alignment::Alignment;
use refraxel_train::backend::Marching;
use refraxel_train::evaluation::Learned;
use refraxel_train::run::{Run, Source, State};
use refraxel_train::{CpuBackend, Options, plan::Plan};
use std::path::Path;

/// A run that was read back, with a backend that renders it.
pub struct Loaded {
    /// Its options.
    pub options: Options,
    /// Its plan.
    pub plan: Plan,
    /// Where it stands.
    pub state: State,
    /// What it was trained on.
    pub source: Source,
    /// What its photographs themselves have learned.
    pub alignment: Alignment,
    /// Its parameters.
    pub backend: CpuBackend,
}

impl Loaded {
    /// What it has learned, looked at so.
    pub fn learned<'a>(&'a self, marching: &'a Marching) -> Learned<'a> {
        Learned { backend: &self.backend, alignment: &self.alignment, marching }
    }
}

/// Reads the run of a folder.
pub fn load_run(folder: &Path) -> Result<Loaded, Failure> {
    let Run { options, plan, state, source, model, optimiser, alignment, .. } = Run::load(folder)?;
    let backend = CpuBackend::resumed(model, optimiser);
    Ok(Loaded { options, plan, state, source, alignment, backend })
}
