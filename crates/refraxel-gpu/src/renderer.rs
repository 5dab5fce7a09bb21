//! A model in the memory of a GPU that is shown and does not learn: straight rays, and bent ones.

use crate::bending::{Bending, Paths, follow};
use crate::constants::STATUS_WORDS;
use crate::field::{upload_medium, upload_shown, without_values};
use crate::kernels::Kernel;
use crate::memory::Buffers;
use crate::pools::{Shape, workgroups};
use crate::reflections::Found;
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
/// Software adapters leave loops after 65 535 iterations of a ray: where a few segments need more, that is an error.
#[derive(Debug)]
pub struct GpuRenderer {
    gpu: Gpu,
    kernel: Kernel,
    buffers: Buffers,
    /// The model without its values.
    held: Model,
    marching: Marching,
    /// Kernels bind the list of reflections, which is empty.
    found: Found,
}

impl GpuRenderer {
    /// A model as it is seen by this marching. A model that is trained needs a [`GpuBackend`](crate::GpuBackend).
    pub fn new(gpu: Gpu, model: &Model, marching: &Marching) -> Result<Self, GpuError> {
        Self::supports(model)?;
        let shape = Shape::new(&gpu, model)?;
        let every_cell = Optimiser::new(model).occupied;
        let mut buffers = upload_shown(&gpu, &shape, model, &every_cell)?;
        let bends = !model.refraction.is_none();
        if bends {
            upload_medium(&gpu, &mut buffers, &model.refraction)?;
            buffers.zeros(&gpu, "status", 4 * u64::from(STATUS_WORDS))?;
        }
        let kernel = Kernel::new(&gpu, if bends { &RENDER_BENT } else { &RENDER }, &shape);
        let occupancy = Kernel::new(&gpu, &OCCUPANCY, &shape);
        buffers.write(&gpu, "task", &[Task::marching(marching, model, 0)]);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        occupancy.run(&gpu, &mut encoder, &[&buffers], workgroups(2 * model.field.map.slots()));
        gpu.queue.submit([encoder.finish()]);
        let (held, marching) = (without_values(model), *marching);
        let found = Found::nothing(&gpu)?;
        gpu.fault().map_or(Ok(Self { gpu, kernel, buffers, held, marching, found }), Err)
    }

    /// Whether a model can be shown: it mirrors nothing.
    pub fn supports(model: &Model) -> Result<(), Unsupported> {
        if !model.reflection.is_none() {
            return Err(Unsupported::Reflection);
        }
        if model.clearcoat.is_some() {
            return Err(Unsupported::Clearcoat);
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
        let mut buffers = RayBuffers::default();
        buffers.fill(gpu, &Lesson::of_rays(rays, refraction), false)?;
        self.buffers.write(gpu, "task", &[Task::marching(&self.marching, &self.held, rays.len())]);
        if refraction.is_none() {
            let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let of = [&self.buffers, &buffers.buffers];
            self.kernel.run(gpu, &mut encoder, &of, workgroups(rays.len()));
            gpu.queue.submit([encoder.finish()]);
        } else {
            let (paths, shown) =
                (Paths::standing(gpu, rays.len())?, Bending::shown(gpu, &self.held, rays.len()));
            let of = [&self.buffers, &buffers.buffers, &paths.buffers, &self.found.buffers];
            follow(gpu, &self.kernel, &of, &shown)?;
        }
        let seen = buffers.buffers.read(gpu, "seen", rays.len())?;
        gpu.fault().map_or(Ok(seen), Err)
    }
}
