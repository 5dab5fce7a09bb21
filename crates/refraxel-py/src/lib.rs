//! Python bindings of refraxel, the module `refraxel._refraxel`. `refraxel/_refraxel.pyi` documents what Python sees of it.
//!
//! Bindings are thin: arrays become the types of the libraries, a call of the libraries runs without the interpreter's lock,
//! and its result becomes arrays. `with_events` does this for calls that take long; `errors` turns failures into exceptions.

#![allow(clippy::result_large_err)] // errors of the libraries become exceptions at once

mod arrays;
mod camera;
mod dataset;
mod errors;
mod evaluation;
mod exact;
mod folder;
mod index_parameters;
mod interruptible;
mod json;
mod medium;
mod model;
mod paths;
mod rendering;
mod run;
mod run_methods;
mod session;
mod settings;
mod sweep;

use pyo3::prelude::*;

/// The module.
#[pymodule]
mod _refraxel {
    #[pymodule_export]
    use super::camera::Camera;
    #[pymodule_export]
    use super::dataset::Dataset;
    #[pymodule_export]
    use super::exact::{Scene, scenes, synth};
    #[pymodule_export]
    use super::folder::Folder;
    #[pymodule_export]
    use super::medium::{Medium, Region};
    #[pymodule_export]
    use super::model::Model;
    #[pymodule_export]
    use super::paths::Paths;
    #[pymodule_export]
    use super::rendering::Rendering;
    #[pymodule_export]
    use super::run::Run;
    #[pymodule_export]
    use super::session::Session;
    #[pymodule_export]
    use super::settings::{options, set_threads};
    #[pymodule_export]
    use super::sweep::{sweep_check, sweep_collect, sweep_jobs, sweep_run};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
