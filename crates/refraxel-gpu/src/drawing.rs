//! Batches that are drawn where they are learned from.

use crate::constants::STATUS_ABSENT;
use crate::device::Device;
use crate::error::GpuError;
use crate::loaded::LoadedModel;
use crate::photographs::{HostReason, Photographs};
use crate::rays::RayBuffers;
use crate::task::{Given, Lesson, Task, batch_of};
use refraxel_train::backend::Batch;
use refraxel_train::rays::{Draw, Edition, RaySampler, Selection};

/// Where batches are drawn.
#[derive(Debug, Default)]
pub(crate) struct Drawing {
    /// Photographs on the device.
    photographs: Option<Photographs>,
    /// Those that found no place there, and why.
    refused: Option<(Edition, HostReason)>,
    /// Why the last batch came from the host.
    pub why_on_host: Option<HostReason>,
}

impl Drawing {
    /// The photographs on the device; `None` where a batch has to come from the host.
    pub(crate) fn photographs(&self) -> Option<&Photographs> {
        self.photographs.as_ref().filter(|_| self.why_on_host.is_none())
    }

    /// Make ready to draw a batch, or note why it has to come from the host.
    pub(crate) fn take_photographs(&mut self, device: &Device, draw: &Draw<'_>) {
        self.why_on_host = self.take(device, draw).err();
    }

    fn take(&mut self, device: &Device, draw: &Draw<'_>) -> Result<(), HostReason> {
        let edition = draw.sampler.photographs_edition();
        if matches!(draw.selection, Selection::Around(_)) {
            return Err(HostReason::NearBorders);
        }
        if let Some((_, why)) = self.refused.as_ref().filter(|(refused, _)| refused == edition) {
            return Err(why.clone());
        }
        let ready = self.make_ready(device, draw.sampler);
        if let Err(why) = &ready {
            self.refused = Some((edition.clone(), why.clone()));
        }
        ready
    }

    /// Has the photographs of a sampler on the device, as they are by now; none are left there where that fails.
    fn make_ready(&mut self, device: &Device, sampler: &RaySampler) -> Result<(), HostReason> {
        // Never those of two runs.
        let known = self.photographs.take().filter(|p| p.edition == *sampler.photographs_edition());
        let mut photographs = known.map_or_else(|| Photographs::new(device, sampler), Ok)?;
        photographs.update(device, sampler)?;
        self.photographs = Some(photographs);
        Ok(())
    }
}

/// Enqueue the drawing of a batch for a model into room for rays.
pub(crate) fn draw(
    model: &LoadedModel,
    photographs: &Photographs,
    draw: &Draw<'_>,
    rays: &mut RayBuffers,
) -> Result<Given, GpuError> {
    let (device, regions) = (model.device(), model.held.refraction.medium.regions().len());
    rays.fit(device, draw.size, false)?;
    model.buffers.write(device, "task", &[Task::drawing(draw.size, photographs.are_exposed())]);
    photographs.select(device, draw, regions);
    let mut encoder = device.encoder();
    let of = [&model.buffers, &photographs.buffers, &rays.buffers];
    photographs.kernel.run(device, &mut encoder, &of, draw.size);
    device.submit(encoder);
    Ok(Given { rays: draw.size, behind: draw.sampler.is_transparent() })
}

/// A batch as the device draws it, and which of its rays may bend.
pub(crate) fn drawn(
    model: &LoadedModel,
    photographs: &Photographs,
    batch: &Draw<'_>,
) -> Result<(Batch, Vec<bool>), GpuError> {
    let (device, mut rays) = (model.device(), RayBuffers::default());
    let given = draw(model, photographs, batch, &mut rays)?;
    let lessons: Vec<Lesson> = rays.buffers.read(device, "lessons", given.rays)?;
    model.buffers.write_at(device, "status", 4 * u64::from(STATUS_ABSENT), &[0_u32]);
    device.fault().map_or(Ok(batch_of(&lessons, given)), Err)
}
