//! Forward and adjoint of a batch: sums of gradients in the memory of a device.

use crate::bending::{Bending, Paths, follow_back};
use crate::coats;
use crate::constants::{COATED, MIRRORS};
use crate::error::GpuError;
use crate::loaded::LoadedModel;
use crate::memory::Buffers;
use crate::rays::RayBuffers;
use crate::reflections::{self, Found};
use crate::show::{Forward, StraightForward, forward, forward_straight};
use crate::task::Task;
use refraxel_train::backend::{Layers, Objective};

/// Room for a batch: its rays, their paths, and what surfaces mirror into them.
#[derive(Debug, Default)]
pub(crate) struct Room {
    pub rays: RayBuffers,
    pub paths: Paths,
    pub found: Found,
}

/// How the adjoints of index samples count.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Adjoints {
    Clipped,
    Whole,
}

/// Forward and adjoint of one batch.
pub(crate) struct Pass<'a> {
    pub model: &'a LoadedModel,
    pub task: Task,
    pub objective: &'a Objective,
}

impl Pass<'_> {
    /// Add up the gradients of the batch that lies in a room.
    pub(crate) fn learn(mut self, adjoints: Adjoints, room: &mut Room) -> Result<(), GpuError> {
        let (device, held, buffers) = (self.model.device(), &self.model.held, &self.model.buffers);
        let bends = !held.refraction.is_none();
        let mut encoder = device.encoder();
        buffers.clear_all(&mut encoder, "probe_gradient");
        device.submit(encoder);
        self.task.wants |= reflections::wants(held, reflections::source(held, Layers::All));
        if !bends || self.task.wants & COATED != 0 {
            coats::fit(device, &mut room.rays.buffers, &self.task)?;
            self.learn_straight(&[buffers, &room.rays.buffers])?;
        }
        if !bends {
            return Ok(());
        }
        room.paths.fit(device, self.task.rays as usize)?;
        let clips = adjoints == Adjoints::Clipped;
        let bending = Bending::learning(device, self.objective, held, room.paths.keeps, clips);
        self.learn_bent(bending, &[buffers, &room.rays.buffers, &room.paths.buffers], &mut room.found)
    }

    /// Forward and adjoint of straight rays, whatever coats the opaque.
    fn learn_straight(&self, of: &[&Buffers]) -> Result<(), GpuError> {
        let (device, kernels, rays) = (self.model.device(), &self.model.kernels, self.task.rays as usize);
        let source = reflections::source(&self.model.held, Layers::All);
        let straight = StraightForward { task: self.task, source, marching: self.objective.marching };
        forward_straight(self.model, &straight, of)?;
        let mut encoder = device.encoder();
        let coat = if self.task.wants & COATED == 0 { None } else { Some(kernels.coat(device)?) };
        if let Some(coat) = coat {
            coat.vjp.run(device, &mut encoder, of, rays);
        }
        kernels.learn.run(device, &mut encoder, of, rays);
        if let Some(coat) = coat {
            coat.learn.run(device, &mut encoder, of, rays);
        }
        device.submit(encoder);
        Ok(())
    }

    /// Forward and adjoint of rays that may bend and be mirrored, portion by portion.
    fn learn_bent(&self, bending: Bending, of: &[&Buffers], found: &mut Found) -> Result<(), GpuError> {
        let (model, task, device) = (self.model, self.task, self.model.device());
        let kernels = model.kernels.bent(device)?;
        let source = reflections::source(&model.held, Layers::All);
        let mut encoder = device.encoder();
        model.buffers.clear_all(&mut encoder, "index_gradient");
        device.submit(encoder);
        for portion in bending.portions(task.rays as usize) {
            let bent = Forward { portion, task, source, marching: self.objective.marching, of };
            let blocks = forward(model, &bent, found)?;
            let all: Vec<&Buffers> = of.iter().copied().chain([&found.buffers]).collect();
            if task.wants & MIRRORS != 0 {
                let mut encoder = device.encoder();
                let vjp = &model.kernels.mirrors(device)?.vjp;
                vjp.run(device, &mut encoder, &all, portion.rays as usize);
                device.submit(encoder);
            }
            follow_back(device, &kernels.learn, &all, &portion, blocks);
        }
        Ok(())
    }
}
