//! How much of each voxel rays see.

use crate::bending::{Bending, Paths, follow};
use crate::error::GpuError;
use crate::loaded::LoadedModel;
use crate::memory::Buffers;
use crate::rays::RayBuffers;
use crate::task::{Lesson, Task};
use refraxel_core::Ray;
use refraxel_train::backend::Marching;

/// Raise the array `weights`, one number per voxel, to the largest weights that a portion of rays gives.
pub(crate) fn weigh(
    model: &LoadedModel,
    weights: &Buffers,
    rays: &[Ray<f32>],
    marching: &Marching,
) -> Result<(), GpuError> {
    let (device, held) = (model.device(), &model.held);
    let mut buffers = RayBuffers::default();
    buffers.fill(device, &Lesson::of_rays(rays, &held.refraction), false)?;
    model.buffers.write(device, "task", &[Task::marching(marching, held, rays.len())]);
    if held.refraction.is_none() {
        let mut encoder = device.encoder();
        let of = [&model.buffers, &buffers.buffers, weights];
        model.kernels.peak.run(device, &mut encoder, &of, rays.len());
        device.submit(encoder);
    } else {
        let paths = Paths::standing(device, rays.len())?;
        let of = [&model.buffers, &buffers.buffers, weights, &paths.buffers];
        let portion = Bending::shown(device, held, marching, rays.len());
        follow(device, &model.kernels.bent(device)?.peak, &of, &portion, 1)?;
    }
    Ok(())
}
