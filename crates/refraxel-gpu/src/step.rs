//! One step on a batch, and what is read back of it.

use crate::bodies;
use crate::caches;
use crate::constants::{OUTCOME_WORDS, STATUS_FAILED, WANTS_FIELD, from_fixed};
use crate::error::GpuError;
use crate::field::{HostMoments, texel_values};
use crate::learn::{Adjoints, Pass, Room};
use crate::loaded::LoadedModel;
use crate::sums::HostSums;
use crate::task::{Given, Task};
use refraxel_train::backend::{Objective, REFRESH, StepOutcome};
use refraxel_train::descent;

/// A step on a batch that is on the device.
pub(crate) struct Step<'a> {
    pub number: u64,
    /// Where its outcome will lie.
    pub place: usize,
    pub given: Given,
    pub objective: &'a Objective,
}

impl Step<'_> {
    /// Enqueue it; what the host moves has moved on return.
    pub(crate) fn enqueue(
        &self,
        model: &mut LoadedModel,
        room: &mut Room,
        moments: &mut HostMoments,
    ) -> Result<(), GpuError> {
        let (device, kernels, field) = (model.device(), &model.kernels, &model.held.field);
        let objective = self.objective;
        let task = self.task(model);
        model.buffers.write(device, "task", &[task]);
        if self.number.is_multiple_of(REFRESH) {
            let mut encoder = device.encoder();
            kernels.occupancy.run(device, &mut encoder, &[&model.buffers], 2 * field.map.slots());
            device.submit(encoder);
        }
        Pass { model, task, objective }.learn(Adjoints::Clipped, room)?;
        let mut encoder = device.encoder();
        let of = [&model.buffers, &room.rays.buffers];
        if objective.moves_field() {
            if objective.tv_density > 0.0 || objective.tv_colour > 0.0 {
                kernels.variation.run(device, &mut encoder, &of, field.map.voxels());
            }
            kernels.update.run(device, &mut encoder, &of, field.map.voxels());
            model.buffers.clear_all(&mut encoder, "touched");
        }
        let texels = texel_values(&model.held.background);
        kernels.update_background.run(device, &mut encoder, &of, texels);
        kernels.conclude.run(device, &mut encoder, &of, 1);
        device.submit(encoder);
        let bends = objective.index.is_some() || objective.absorption.is_some();
        if bends || objective.reflection.is_some() {
            self.move_bodies(model, moments)?;
        }
        Ok(())
    }

    /// What kernels are told of it.
    fn task(&self, model: &LoadedModel) -> Task {
        let mut task = Task::learning(self.objective, &model.held, self.given);
        if !self.objective.moves_field() {
            task.wants &= !WANTS_FIELD;
        }
        task.tv_turn = (self.number % u64::from(self.objective.tv_period.max(1))) as u32;
        task.outcome = self.place as u32;
        task
    }

    /// The step of what bends rays, absorbs and mirrors, which the host takes: its grids are small. Not after a failure.
    fn move_bodies(&self, model: &mut LoadedModel, moments: &mut HostMoments) -> Result<(), GpuError> {
        if model.held.refraction.is_none() && model.held.clearcoat.is_none() {
            return Ok(());
        }
        let words = OUTCOME_WORDS * self.place;
        let sums = HostSums::read(model, "outcomes", 4 * words as u64, OUTCOME_WORDS)?;
        let [_, _, _, failed, _, cut, rays, ..] = sums.words[..] else { return Ok(()) };
        if cut != 0 {
            return Err(model.device().cut_short());
        }
        if failed != 0 {
            return Ok(());
        }
        let are_finite = self.descend(model, moments, sums, rays as usize);
        let device = &model.gpu.device;
        if !are_finite {
            model.buffers.write_at(device, "outcomes", 4 * (words + 3) as u64, &[1_u32]);
            model.buffers.write_at(device, "status", 4 * u64::from(STATUS_FAILED), &[1_u32]);
        }
        if self.objective.reflection.is_some() {
            caches::upload(device, &mut model.buffers, &model.held)?;
        }
        if model.held.refraction.is_none() {
            return Ok(());
        }
        bodies::upload(device, &mut model.buffers, &model.held.refraction)
    }

    /// Move what the host moves by the gradients of so many rays; whether all of it is finite.
    fn descend(
        &self,
        model: &mut LoadedModel,
        moments: &mut HostMoments,
        sums: HostSums,
        rays: usize,
    ) -> bool {
        let HostSums { medium: gradient, absorption, mirrored, .. } = sums;
        let (objective, held) = (self.objective, &mut model.held);
        let (refraction, of_index) = (&mut held.refraction, &mut moments.index[..]);
        let learned = descent::IndexStep { gradient, rays, step: self.number };
        let index = objective.index.as_ref();
        let is_index_finite = index.is_none_or(|o| descent::update_index(refraction, of_index, learned, o));
        let absorbing = objective.absorption.as_ref();
        let is_absorption_finite =
            absorbing.is_none_or(|o| descent::update_absorption(refraction, of_index, &absorption, o));
        let (reflection, of_mirrors) = (&mut held.reflection, &mut moments.reflection[..]);
        let mirroring = objective.reflection.as_ref();
        let are_mirrors_finite =
            mirroring.is_none_or(|o| descent::update_mirrors(reflection, of_mirrors, &mirrored.mirrors, o));
        let (clearcoat, of_coat) = (&mut held.clearcoat, &mut moments.clearcoat);
        let coat = mirroring.zip(clearcoat.as_mut()).zip(mirrored.clearcoat.as_ref());
        let is_coat_finite = coat.is_none_or(|((o, coat), d)| descent::update_clearcoat(coat, of_coat, d, o));
        is_index_finite && is_absorption_finite && are_mirrors_finite && is_coat_finite
    }
}

/// The outcomes of steps that were enqueued, given the numbers and rays of these in the order of their places.
pub(crate) fn outcomes(model: &LoadedModel, enqueued: &[(u64, u64)]) -> Result<Vec<StepOutcome>, GpuError> {
    let device = model.device();
    let all: Vec<[u32; OUTCOME_WORDS]> = model.buffers.read(device, "outcomes", enqueued.len())?;
    if all.iter().any(|words| words[5] != 0) {
        return Err(device.cut_short());
    }
    let outcome = |(&(step, _), words): (&(u64, u64), &[u32; OUTCOME_WORDS])| {
        let [low, high, samples, failed, overflows, _, rays, _] = *words;
        let (squared_error, samples) = (from_fixed(low, high), samples.into());
        let (rays, overflows) = (rays.into(), overflows.into());
        StepOutcome { step, rays, squared_error, samples, overflows, finite: failed == 0 }
    };
    Ok(enqueued.iter().zip(&all).map(outcome).collect())
}
