//! A model in the memory of a GPU that is shown and does not learn: straight rays, and bent ones.

use crate::bodies;
use crate::field::{upload_shown, without_values};
use crate::kernels::Kernel;
use crate::memory::Buffers;
use crate::pools::{Shape, workgroups};
use crate::sources::{OCCUPANCY, RENDER, RENDER_BENT};
use crate::step::RayBuffers;
use crate::task::{Lesson, Seen, Task};
use crate::{Gpu, GpuError, Unsupported};
use refraxel_core::radiance::Pixel;
use refraxel_core::{Integrator, Ray};
use refraxel_train::backend::Marching;
use refraxel_train::model::{Model, Optimiser};

/// Rays of one dispatch: short enough for a watchdog where rays bend.
const PORTION: usize = 1 << 14;

/// A model that is shown.
///
/// Rays bend in smooth regions and at sharp surfaces, with bodies in bodies and total reflection, as those of
/// [`Tracer`](refraxel_core::Tracer) in f32. What the model must not have is said by [`Self::supports`].
///
/// Software adapters leave loops after 65 535 iterations of a ray, without a word: they show short paths only.
#[derive(Debug)]
pub struct GpuRenderer {
    gpu: Gpu,
    kernel: Kernel,
    buffers: Buffers,
    /// The model without its values.
    held: Model,
    marching: Marching,
}

impl GpuRenderer {
    /// A model as it is seen by this marching. A model that is trained needs a [`GpuBackend`](crate::GpuBackend).
    pub fn new(gpu: Gpu, model: &Model, marching: &Marching) -> Result<Self, GpuError> {
        Self::supports(model)?;
        let shape = Shape::new(&gpu, model.field.degree, model.field.map.voxels())?;
        let every_cell = Optimiser::new(model).occupied;
        let mut buffers = upload_shown(&gpu, &shape, model, &every_cell)?;
        let bends = !model.refraction.is_none();
        if bends {
            bodies::upload(&gpu, &mut buffers, &model.refraction)?;
        }
        let kernel = Kernel::new(&gpu, if bends { &RENDER_BENT } else { &RENDER }, &shape);
        let occupancy = Kernel::new(&gpu, &OCCUPANCY, &shape);
        buffers.write(&gpu, "task", &[Task::marching(marching, &model.field, 0)]);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        occupancy.run(&gpu, &mut encoder, &[&buffers], workgroups(2 * model.field.map.slots()));
        gpu.queue.submit([encoder.finish()]);
        let (held, marching) = (without_values(model), *marching);
        gpu.fault().map_or(Ok(Self { gpu, kernel, buffers, held, marching }), Err)
    }

    /// Whether a model can be shown: it mirrors nothing, and its bodies are clear.
    pub fn supports(model: &Model) -> Result<(), Unsupported> {
        if !model.reflection.is_none() {
            return Err(Unsupported::Reflection);
        }
        if model.clearcoat.is_some() {
            return Err(Unsupported::Clearcoat);
        }
        if model.refraction.is_absorbing() {
            return Err(Unsupported::Absorption);
        }
        if model.refraction.optics.integrator == Integrator::Leapfrog {
            Ok(())
        } else {
            Err(Unsupported::Integrator)
        }
    }

    /// What rays show, over the background.
    pub fn render(&self, rays: &[Ray<f32>]) -> Result<Vec<Pixel<f32>>, GpuError> {
        let mut out = Vec::with_capacity(rays.len());
        for portion in rays.chunks(PORTION) {
            let seen = self.portion(portion)?;
            let pixel = |s: Seen| Pixel { colour: s.colour, transmittance: s.transmittance, depth: s.depth };
            out.extend(seen.into_iter().map(pixel));
        }
        Ok(out)
    }

    fn portion(&self, rays: &[Ray<f32>]) -> Result<Vec<Seen>, GpuError> {
        let (gpu, refraction) = (&self.gpu, &self.held.refraction);
        let mut lessons = Lesson::of_rays(rays);
        for (lesson, ray) in lessons.iter_mut().zip(rays) {
            lesson.bends = refraction.admits(ray).into();
        }
        let mut buffers = RayBuffers::default();
        buffers.fill(gpu, &lessons, false)?;
        self.buffers.write(gpu, "task", &[Task::marching(&self.marching, &self.held.field, rays.len())]);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.kernel.run(gpu, &mut encoder, &[&self.buffers, &buffers.buffers], workgroups(rays.len()));
        gpu.queue.submit([encoder.finish()]);
        let seen = buffers.buffers.read(gpu, "seen", rays.len())?;
        gpu.fault().map_or(Ok(seen), Err)
    }
}
