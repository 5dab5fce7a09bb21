//! A model in the memory of a device, with the kernels that are made for it.

use crate::caches;
use crate::constants::STATUS_WORDS;
use crate::device::Device;
use crate::error::{GpuError, Unsupported};
use crate::field::{upload, upload_medium, upload_mirrors, upload_shown, without_values};
use crate::gpu::Gpu;
use crate::kernels::Kernels;
use crate::memory::Buffers;
use crate::shape::{Purpose, Shape};
use crate::task::Task;
use refraxel_core::Integrator;
use refraxel_train::backend::Marching;
use refraxel_train::model::{Model, Optimiser, Refraction};
use std::sync::Arc;

/// Rays of one dispatch of a rendering: short enough for a watchdog, long enough to fill a device.
const PORTION: usize = 1 << 16;
/// The same where they may bend.
const BENT_PORTION: usize = 1 << 14;
/// Steps across a grid along its diagonal, in units of its longest edge, bounded from above.
const DIAGONAL: f64 = 1.75;

/// A model that a device holds.
#[derive(Debug)]
pub(crate) struct LoadedModel {
    pub gpu: Gpu,
    pub kernels: Arc<Kernels>,
    /// The model without the values that the device holds.
    pub held: Model,
    pub buffers: Buffers,
}

/// Whether kernels have everything that a model needs.
pub(crate) fn supports(model: &Model) -> Result<(), Unsupported> {
    let leapfrog = model.refraction.optics.integrator == Integrator::Leapfrog;
    if leapfrog { Ok(()) } else { Err(Unsupported::Integrator) }
}

impl LoadedModel {
    /// One that goes on to learn from this state of the optimiser.
    ///
    /// # Panics
    /// If the state [does not fit](Optimiser::fits) the model.
    pub(crate) fn learning(gpu: Gpu, model: &Model, optimiser: &Optimiser) -> Result<Self, GpuError> {
        assert!(optimiser.fits(model), "the optimiser's state is that of another model");
        supports(model)?;
        let shape = Shape::new(&gpu.device, model, Purpose::Learning)?;
        let kernels = gpu.kernels(shape)?;
        let buffers = upload(&gpu.device, &shape, model, optimiser)?;
        Ok(Self { gpu, kernels, held: without_values(model), buffers })
    }

    /// One that is shown, and has no room to learn.
    pub(crate) fn showing(gpu: Gpu, model: &Model) -> Result<Self, GpuError> {
        supports(model)?;
        let device = &gpu.device;
        let shape = Shape::new(device, model, Purpose::Showing)?;
        let kernels = gpu.kernels(shape)?;
        let mut buffers = upload_shown(device, &shape, model, &Optimiser::new(model).occupied)?;
        buffers.zeros(device, "status", 4 * u64::from(STATUS_WORDS))?;
        upload_medium(device, &mut buffers, &model.refraction)?;
        caches::upload(device, &mut buffers, model)?;
        Ok(Self { gpu, kernels, held: without_values(model), buffers })
    }

    /// Take another model in place of this one that learns.
    ///
    /// # Panics
    /// As [`Self::learning`].
    pub(crate) fn replace(&mut self, model: &Model, optimiser: &Optimiser) -> Result<(), GpuError> {
        assert!(optimiser.fits(model), "the optimiser's state is that of another model");
        supports(model)?;
        let shape = Shape::new(self.device(), model, Purpose::Learning)?;
        if let Some(fault) = self.gpu.fault() {
            return Err(fault); // with the arrays as they are: whoever asks goes on to be told
        }
        self.buffers = Buffers::default(); // no two fields at a time
        self.kernels = self.gpu.kernels(shape)?;
        self.buffers = upload(self.device(), &shape, model, optimiser)?;
        self.held = without_values(model);
        Ok(())
    }

    /// Bend its rays otherwise.
    pub(crate) fn set_medium(&mut self, medium: Refraction) -> Result<(), GpuError> {
        self.held.refraction = medium;
        supports(&self.held)?;
        Shape::new(&self.gpu.device, &self.held, self.kernels.shape.purpose)?;
        upload_medium(&self.gpu.device, &mut self.buffers, &self.held.refraction)
    }

    /// Room for what it mirrors by now, with the caches.
    pub(crate) fn make_mirrors(&mut self) -> Result<(), GpuError> {
        upload_mirrors(&self.gpu.device, &mut self.buffers, &self.held)
    }

    /// Take its caches there as they are by now.
    pub(crate) fn upload_caches(&mut self) -> Result<(), GpuError> {
        caches::upload(&self.gpu.device, &mut self.buffers, &self.held)
    }

    /// The device that holds it.
    pub(crate) fn device(&self) -> &Device {
        &self.gpu.device
    }

    /// Find out which cells may hold matter.
    pub(crate) fn refresh_occupancy(&self, marching: &Marching) {
        let device = self.device();
        self.buffers.write(device, "task", &[Task::marching(marching, &self.held, 0)]);
        let mut encoder = device.encoder();
        let slots = self.held.field.map.slots();
        self.kernels.occupancy.run(device, &mut encoder, &[&self.buffers], 2 * slots);
        device.submit(encoder);
    }

    /// Rays of one dispatch.
    pub(crate) fn portion(&self) -> usize {
        if self.held.refraction.is_none() { PORTION } else { BENT_PORTION }
    }

    /// Refuse rays that a software adapter would leave half-way, with so many iterations per sample.
    pub(crate) fn check_steps(&self, marching: &Marching, per_sample: u64) -> Result<(), GpuError> {
        let Some(most) = self.device().iteration_limit() else { return Ok(()) };
        let nodes = self.held.field.domain.resolution.into_iter().max().unwrap_or(0);
        let steps = (DIAGONAL * f64::from(nodes) / f64::from(marching.step)) as u64;
        let needed = steps * per_sample;
        let adapter = || self.gpu.adapter().name.clone();
        if needed > most { Err(GpuError::TooManySteps { adapter: adapter(), needed, most }) } else { Ok(()) }
    }

    /// Iterations per sample: of the loop over samples, of the search for the next one, and of shading.
    pub(crate) fn forward_loops(&self) -> u64 {
        2 + u64::from(self.kernels.shape.blocks())
    }

    /// The same with the way back: eight corners, their blocks, and where rays receive gradients both once more.
    pub(crate) fn backward_loops(&self, wants_rays: bool) -> u64 {
        self.forward_loops() * (1 + 8 + if wants_rays { 9 } else { 0 })
    }
}
