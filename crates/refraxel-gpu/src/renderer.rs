//! A model in the memory of a GPU that is shown and does not learn.

use crate::error::GpuError;
use crate::gpu::Gpu;
use crate::loaded::LoadedModel;
use crate::show::{Showing, show};
use refraxel_core::Ray;
use refraxel_core::radiance::Pixel;
use refraxel_train::Refraction;
use refraxel_train::backend::{Layers, Marching};
use refraxel_train::model::Model;

/// A model that is shown, with everything that [`GpuBackend`](crate::GpuBackend) shows, but without the memory that learning needs.
///
/// Software adapters leave loops after 65 535 iterations of a ray: where a ray, or a few segments of its path, need more, that is an
/// error.
#[derive(Debug)]
pub struct GpuRenderer {
    model: LoadedModel,
    marching: Marching,
}

impl GpuRenderer {
    /// A model as it is seen by this marching; what cannot be shown is said by [`supports`](crate::GpuBackend::supports).
    pub fn new(gpu: Gpu, model: &Model, marching: &Marching) -> Result<Self, GpuError> {
        let model = LoadedModel::showing(gpu, model)?;
        model.refresh_occupancy(marching);
        let fault = model.gpu.fault();
        fault.map_or(Ok(Self { model, marching: *marching }), Err)
    }

    /// Bends the rays otherwise.
    pub fn set_medium(&mut self, medium: Refraction) -> Result<(), GpuError> {
        self.model.set_medium(medium)?;
        self.model.gpu.fault().map_or(Ok(()), Err)
    }

    /// What rays show, over the background.
    pub fn render(&self, rays: &[Ray<f32>], layers: Layers) -> Result<Vec<Pixel<f32>>, GpuError> {
        let mut out = Vec::with_capacity(rays.len());
        for portion in rays.chunks(self.model.portion()) {
            let seen = show(&self.model, portion, &self.marching, Showing::layers(layers))?;
            out.extend(seen.into_iter().map(Pixel::from));
        }
        self.model.gpu.fault().map_or(Ok(out), Err)
    }
}
