//! A program without GPUs.

use super::refusals::unusable;
use crate::cli::BenchArgs;
use crate::exit::Failure;
use anyhow::anyhow;
use refraxel_train::backend::Backend;
use refraxel_train::model::{Model, Optimiser};
use refraxel_train::session::BackendError;
use std::convert::Infallible;

/// There is none.
pub type Gpu = Infallible;

/// Lists adapters: nobody can.
pub fn devices(_: bool) -> Result<(), Failure> {
    Err(missing())
}

/// A backend on a GPU: there is none.
pub fn gpu_backend(gpu: &Gpu, _: &Model, _: Option<&Optimiser>) -> Result<Box<dyn Backend>, BackendError> {
    match *gpu {}
}

/// Measures a GPU: there is none.
pub fn bench(gpu: Gpu, _: &BenchArgs) -> Result<(), Failure> {
    match gpu {}
}

pub(super) fn missing() -> Failure {
    unusable(anyhow!(
        "this program was built without GPUs; `cargo install --locked --path crates/refraxel --features gpu` builds one that has them, \
         or use `--device cpu`"
    ))
}

/// A model that a GPU shows: there is none.
pub mod viewer {
    use super::Gpu;
    use refraxel_core::Ray;
    use refraxel_core::radiance::Pixel;
    use refraxel_train::Refraction;
    use refraxel_train::backend::{Layers, Marching};
    use refraxel_train::model::Model;

    /// There is none.
    pub enum ModelViewer {}

    impl ModelViewer {
        /// None.
        pub fn new(gpu: Gpu, _: &Model, _: &Marching) -> Result<Self, String> {
            match gpu {}
        }

        /// There is none to bend rays.
        pub fn set_medium(&mut self, _: &Refraction) -> Result<(), String> {
            match *self {}
        }

        /// There is none to show any.
        pub fn render(&self, _: &[Ray<f32>], _: Layers) -> Result<Vec<Pixel<f32>>, String> {
            match *self {}
        }
    }
}
