//! The gradients of a batch without a step.

use crate::caches;
use crate::constants::{
    STATUS_CUT, STATUS_ERROR, STATUS_LOSS, STATUS_OVERFLOWS, STATUS_SAMPLES, STATUS_WORDS, WANTS_FIELD,
    WANTS_INDEX, WANTS_RAYS, from_fixed,
};
use crate::error::GpuError;
use crate::learn::{Adjoints, Pass, Room};
use crate::loaded::LoadedModel;
use crate::sums::{self, HostSums};
use crate::task::{Given, Lesson, RayAdjoint, Task};
use refraxel_core::index::MediumGradient;
use refraxel_core::{AlignedVec, FieldGradient};
use refraxel_train::backend::{Batch, Objective, RayGradient, StepOutcome};

/// What a batch gives: gradients of the field and the texels, of rays, and the outcome.
pub(crate) struct Gradients {
    pub field: FieldGradient<f32>,
    pub texels: Vec<[f32; 3]>,
    pub medium: MediumGradient<f32>,
    pub absorption: Vec<[f64; 3]>,
    pub mirrored: caches::Gradient,
    pub rays: Vec<RayGradient>,
    pub outcome: StepOutcome,
}

impl Gradients {
    /// No gradients, of a batch that failed.
    pub(crate) fn none(batch: &Batch) -> Self {
        let rays = vec![RayGradient::zero(); batch.rays.len()];
        let outcome = StepOutcome { rays: rays.len() as u64, ..StepOutcome::default() };
        let medium = MediumGradient { index: Vec::new(), level_set: Vec::new() };
        let (texels, absorption, mirrored) = (Vec::new(), Vec::new(), caches::Gradient::default());
        Self { field: no_field(), texels, medium, absorption, mirrored, rays, outcome }
    }

    /// Forward and adjoint of a batch; of the rays alone, where the field is not among the bits `wants`.
    pub(crate) fn of(
        model: &LoadedModel,
        batch: &Batch,
        objective: &Objective,
        wants: u32,
    ) -> Result<Self, GpuError> {
        let (device, mut room) = (model.device(), Room::default());
        room.rays.fill(device, &Lesson::of_batch(batch, &model.held.refraction), true)?;
        let mut task = Task::learning(objective, &model.held, Given::of(batch));
        task.wants = (task.wants & !(WANTS_FIELD | WANTS_INDEX)) | WANTS_RAYS | wants;
        Pass { model, task, objective }.learn(Adjoints::Whole, &mut room)?;
        let sums = HostSums::read(model, "status", 0, STATUS_WORDS as usize)?;
        let HostSums { words: status, medium, absorption, mirrored } = sums;
        if status[STATUS_CUT as usize] != 0 {
            return Err(device.cut_short());
        }
        let outcome = StepOutcome {
            rays: batch.rays.len() as u64,
            squared_error: from_fixed(status[STATUS_ERROR as usize], status[STATUS_ERROR as usize + 1]),
            samples: status[STATUS_SAMPLES as usize].into(),
            overflows: status[STATUS_OVERFLOWS as usize].into(),
            finite: status[STATUS_LOSS as usize] == 0,
            step: 0,
        };
        let adjoints: Vec<RayAdjoint> = room.rays.buffers.read(device, "ray_gradients", batch.rays.len())?;
        let rays = adjoints.into_iter().map(RayGradient::from).collect();
        let texels = sums::of_texels(model)?;
        let field = if wants & WANTS_FIELD == 0 { no_field() } else { sums::of_field(model)? };
        sums::clear(model);
        Ok(Self { field, texels, medium, absorption, mirrored, rays, outcome })
    }
}

/// How many voxels a batch gives a gradient to.
pub(crate) fn touched(model: &LoadedModel, batch: &Batch, objective: &Objective) -> Result<u64, GpuError> {
    let (device, mut room) = (model.device(), Room::default());
    room.rays.fill(device, &Lesson::of_batch(batch, &model.held.refraction), false)?;
    let task = Task::learning(objective, &model.held, Given::of(batch));
    Pass { model, task, objective }.learn(Adjoints::Clipped, &mut room)?;
    let words: Vec<u64> = model.buffers.read(device, "touched", model.held.field.map.slots())?;
    sums::clear(model);
    Ok(words.iter().map(|bits| u64::from(bits.count_ones())).sum())
}

/// The gradient of a field that is not wanted.
fn no_field() -> FieldGradient<f32> {
    FieldGradient { density: AlignedVec::from_slice(&[]), colour: AlignedVec::from_slice(&[]) }
}
