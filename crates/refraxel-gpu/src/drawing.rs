//! Batches that are drawn where they are learned from.

use crate::backend::GpuBackend;
use crate::constants::STATUS_ABSENT;
use crate::photographs::{OnHost, Photographs};
use crate::pools::workgroups;
use crate::step::RayBuffers;
use crate::task::{Given, Lesson, Task, batch_of};
use crate::{Gpu, GpuError};
use refraxel_train::backend::Batch;
use refraxel_train::rays::{Draw, Edition, RaySampler, Selection};

/// Where batches are drawn.
#[derive(Debug, Default)]
pub(crate) struct Drawing {
    /// Photographs on the device.
    photographs: Option<Photographs>,
    /// Those that found no place there, and why.
    refused: Option<(Edition, OnHost)>,
    /// Why the last batch came from the host.
    pub why_on_host: Option<OnHost>,
}

impl Drawing {
    /// The photographs on the device; `None` where a batch has to come from the host.
    pub(crate) fn photographs(&self) -> Option<&Photographs> {
        self.photographs.as_ref().filter(|_| self.why_on_host.is_none())
    }

    fn take(&mut self, gpu: &Gpu, draw: &Draw<'_>) -> Result<(), OnHost> {
        let edition = draw.sampler.photographs_edition();
        if matches!(draw.selection, Selection::Around(_)) {
            return Err(OnHost::NearBorders);
        }
        if let Some((_, why)) = self.refused.as_ref().filter(|(refused, _)| refused == edition) {
            return Err(why.clone());
        }
        let ready = self.make_ready(gpu, draw.sampler);
        if let Err(why) = &ready {
            self.refused = Some((edition.clone(), why.clone()));
        }
        ready
    }

    /// Has the photographs of a sampler on the device, as they are by now; none are left there where that fails.
    fn make_ready(&mut self, gpu: &Gpu, sampler: &RaySampler) -> Result<(), OnHost> {
        // Never those of two runs.
        let known = self.photographs.take().filter(|p| p.edition == *sampler.photographs_edition());
        let mut photographs = known.map_or_else(|| Photographs::new(gpu, sampler), Ok)?;
        photographs.update(gpu, sampler)?;
        self.photographs = Some(photographs);
        Ok(())
    }
}

impl GpuBackend {
    /// A batch as the device draws it, and which of its rays may bend; `None` where it has to come from the host, see
    /// [`why_on_host`](refraxel_train::Backend::why_on_host).
    pub fn drawn(&mut self, draw: &Draw<'_>) -> Result<Option<(Batch, Vec<bool>)>, GpuError> {
        self.take_photographs(draw);
        let Some(photographs) = self.drawing.photographs() else { return Ok(None) };
        let mut rays = RayBuffers::default();
        let given = self.draw(photographs, draw, &mut rays)?;
        let lessons: Vec<Lesson> = rays.buffers.read(&self.gpu, "lessons", given.rays)?;
        self.buffers.write_at(&self.gpu, "status", 4 * u64::from(STATUS_ABSENT), &[0_u32]);
        self.gpu.fault().map_or(Ok(Some(batch_of(&lessons, given))), Err)
    }

    /// Make ready to draw a batch, or note why it has to come from the host.
    pub(crate) fn take_photographs(&mut self, draw: &Draw<'_>) {
        let ready = self.drawing.take(&self.gpu, draw);
        self.drawing.why_on_host = ready.err();
    }

    /// Enqueue the drawing of a batch into room for rays.
    pub(crate) fn draw(
        &self,
        photographs: &Photographs,
        draw: &Draw<'_>,
        rays: &mut RayBuffers,
    ) -> Result<Given, GpuError> {
        let (gpu, regions) = (&self.gpu, self.held.refraction.medium.regions().len());
        rays.fit(gpu, draw.size, false)?;
        self.buffers.write(gpu, "task", &[Task::drawing(draw.size, photographs.are_exposed())]);
        photographs.select(gpu, draw, regions);
        let mut encoder = self.encoder();
        let of = [&self.buffers, &photographs.buffers, &rays.buffers];
        photographs.kernel.run(gpu, &mut encoder, &of, workgroups(draw.size));
        gpu.queue.submit([encoder.finish()]);
        Ok(Given { rays: draw.size, behind: draw.sampler.is_transparent() })
    }
}
