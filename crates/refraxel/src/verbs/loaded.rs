//! A run that was read back, with a backend that renders it.

use crate::exit::Failure;
use refraxel_train::exposures::Exposures;
use refraxel_train::poses::Poses;
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
    /// Where its cameras are, if they learned that.
    pub poses: Option<Poses>,
    /// How its photographs are exposed, if they learned that.
    pub exposures: Option<Exposures>,
    /// Its parameters.
    pub backend: CpuBackend,
}

/// Reads the run of a folder.
pub fn load_run(folder: &Path) -> Result<Loaded, Failure> {
    let Run { options, plan, state, source, model, optimiser, poses, exposures, .. } = Run::load(folder)?;
    Ok(Loaded {
        options,
        plan,
        state,
        source,
        poses,
        exposures,
        backend: CpuBackend::resumed(model, optimiser),
    })
}
