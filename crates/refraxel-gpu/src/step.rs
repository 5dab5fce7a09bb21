//! The passes over a batch: forward, adjoint, update; and what is read back of them.

use crate::backend::GpuBackend;
use crate::bending::{Bending, Paths, follow_back};
use crate::bodies;
use crate::coats;
use crate::constants::{
    COATED, MIRRORS, OUTCOME_WORDS, STATUS_CUT, STATUS_ERROR, STATUS_FAILED, STATUS_LOSS, STATUS_OVERFLOWS,
    STATUS_SAMPLES, STATUS_WORDS, WANTS_FIELD, WANTS_INDEX, WANTS_RAYS, from_fixed,
};
use crate::field::{gradients, texel_values};
use crate::memory::Buffers;
use crate::pools::workgroups;
use crate::reflections::{self, Found};
use crate::show::{Forward, StraightForward};
use crate::task::{Given, Lesson, RayAdjoint, Seen, Task};
use crate::{Gpu, GpuError};
use refraxel_core::index::MediumGradient;
use refraxel_core::{AlignedVec, FieldGradient};
use refraxel_train::backend::{Batch, Layers, Objective, REFRESH, RayGradient, StepOutcome};
use refraxel_train::descent;

/// Rays on a device, with room for what they show and receive.
#[derive(Debug, Default)]
pub(crate) struct RayBuffers {
    pub buffers: Buffers,
    capacity: usize,
}

impl RayBuffers {
    /// Make room for so many rays, and for their gradients if they are wanted.
    pub(crate) fn fit(&mut self, gpu: &Gpu, n: usize, wants_gradients: bool) -> Result<(), GpuError> {
        if n > self.capacity || self.buffers.get("lessons").is_none() {
            self.buffers.zeros(gpu, "lessons", (n * size_of::<Lesson>()) as u64)?;
            self.buffers.zeros(gpu, "seen", (n * size_of::<Seen>()) as u64)?;
            self.capacity = n;
        }
        let gradients = if wants_gradients { n } else { 1 };
        let bytes = (gradients * size_of::<RayAdjoint>()) as u64;
        let fits = self.buffers.get("ray_gradients").is_some_and(|b| b.size() >= bytes);
        if fits { Ok(()) } else { self.buffers.zeros(gpu, "ray_gradients", bytes) }
    }

    /// Put rays there.
    pub(crate) fn fill(
        &mut self,
        gpu: &Gpu,
        lessons: &[Lesson],
        wants_gradients: bool,
    ) -> Result<(), GpuError> {
        self.fit(gpu, lessons.len(), wants_gradients)?;
        self.buffers.write(gpu, "lessons", lessons);
        Ok(())
    }
}

/// Room for a batch: its rays, their paths, and what surfaces mirror into them.
#[derive(Debug, Default)]
pub(crate) struct Room {
    pub rays: RayBuffers,
    pub paths: Paths,
    pub found: Found,
}

/// How the adjoints of index samples count.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Adjoints {
    Clipped,
    Whole,
}

/// What the host moves a step by, and some words that were read with it.
struct HostSums {
    words: Vec<u32>,
    /// Of what bends rays, and of what absorbs.
    medium: (MediumGradient<f32>, Vec<[f64; 3]>),
    mirrored: reflections::Gradient,
}

/// What a batch gives: gradients of the field and the texels, of rays, and the outcome.
pub(crate) struct Gradients {
    pub field: FieldGradient<f32>,
    pub texels: Vec<[f32; 3]>,
    pub medium: MediumGradient<f32>,
    pub absorption: Vec<[f64; 3]>,
    pub mirrored: reflections::Gradient,
    pub rays: Vec<RayGradient>,
    pub outcome: StepOutcome,
}

impl Gradients {
    /// No gradients, of a batch that failed.
    pub(crate) fn none(batch: &Batch) -> Self {
        let none = || AlignedVec::from_slice(&[]);
        let rays = vec![RayGradient::zero(); batch.rays.len()];
        let outcome = StepOutcome { rays: rays.len() as u64, ..StepOutcome::default() };
        let field = FieldGradient { density: none(), colour: none() };
        let medium = MediumGradient { index: Vec::new(), level_set: Vec::new() };
        let (texels, absorption, mirrored) = (Vec::new(), Vec::new(), reflections::Gradient::default());
        Self { field, texels, medium, absorption, mirrored, rays, outcome }
    }
}

impl GpuBackend {
    pub(crate) fn encoder(&self) -> wgpu::CommandEncoder {
        self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Put a batch into the room for the one that learns.
    pub(crate) fn put(&mut self, batch: &Batch) -> Result<Given, GpuError> {
        self.room.rays.fill(&self.gpu, &Lesson::of_batch(batch, &self.held.refraction), false)?;
        Ok(Given::of(batch))
    }

    /// Enqueue one step on the batch that is there; its outcome will lie at `task.outcome`.
    pub(crate) fn enqueue(
        &mut self,
        given: Given,
        objective: &Objective,
        step: u64,
        outcome: usize,
    ) -> Result<(), GpuError> {
        let (gpu, kernels, field) = (&self.gpu, &self.kernels, &self.held.field);
        let mut task = Task::learning(objective, &self.held, given);
        let moves = objective.moves_field();
        if !moves {
            task.wants &= !WANTS_FIELD;
        }
        task.tv_turn = (step % u64::from(objective.tv_period.max(1))) as u32;
        task.outcome = outcome as u32;
        self.buffers.write(gpu, "task", &[task]);
        let mut encoder = self.encoder();
        let voxels = workgroups(field.map.voxels());
        if step.is_multiple_of(REFRESH) {
            kernels.occupancy.run(gpu, &mut encoder, &[&self.buffers], workgroups(2 * field.map.slots()));
        }
        gpu.queue.submit([encoder.finish()]);
        let mut room = std::mem::take(&mut self.room);
        let learned = self.learn(task, objective, Adjoints::Clipped, &mut room);
        self.room = room;
        learned?;
        encoder = self.encoder();
        let of = [&self.buffers, &self.room.rays.buffers];
        if moves {
            if objective.tv_density > 0.0 || objective.tv_colour > 0.0 {
                kernels.variation.run(gpu, &mut encoder, &of, voxels);
            }
            kernels.update.run(gpu, &mut encoder, &of, voxels);
            clear(&mut encoder, &self.buffers, "touched");
        }
        let texels = workgroups(texel_values(&self.held.background));
        kernels.update_background.run(gpu, &mut encoder, &of, texels);
        kernels.conclude.run(gpu, &mut encoder, &of, 1);
        gpu.queue.submit([encoder.finish()]);
        let bends = objective.index.is_some() || objective.absorption.is_some();
        if bends || objective.reflection.is_some() {
            self.move_bodies(objective, step, outcome)?;
        }
        Ok(())
    }

    /// Forward and adjoint of a batch.
    fn learn(
        &self,
        mut task: Task,
        objective: &Objective,
        adjoints: Adjoints,
        room: &mut Room,
    ) -> Result<(), GpuError> {
        let (gpu, bends) = (&self.gpu, !self.held.refraction.is_none());
        let mut encoder = self.encoder();
        clear(&mut encoder, &self.buffers, "probe_gradient");
        gpu.queue.submit([encoder.finish()]);
        task.wants |= reflections::wants(&self.held, reflections::source(&self.held, Layers::All));
        if !bends || task.wants & COATED != 0 {
            coats::fit(gpu, &mut room.rays.buffers, &task)?;
            self.learn_straight(task, objective, &[&self.buffers, &room.rays.buffers])?;
        }
        if !bends {
            return Ok(());
        }
        room.paths.fit(gpu, task.rays as usize)?;
        let clips = adjoints == Adjoints::Clipped;
        let bending = Bending::learning(gpu, objective, &self.held, room.paths.keeps, clips);
        let of = [&self.buffers, &room.rays.buffers, &room.paths.buffers];
        self.learn_bent(bending, task, objective, &of, &mut room.found)
    }

    /// Forward and adjoint of straight rays, whatever coats the opaque.
    fn learn_straight(&self, task: Task, objective: &Objective, of: &[&Buffers]) -> Result<(), GpuError> {
        let (gpu, groups) = (&self.gpu, workgroups(task.rays as usize));
        let source = reflections::source(&self.held, Layers::All);
        self.forward_straight(&StraightForward { task, source, marching: objective.marching }, of)?;
        let mut encoder = self.encoder();
        let coat = if task.wants & COATED == 0 { None } else { Some(self.kernels.coat(gpu)?) };
        if let Some(coat) = coat {
            coat.vjp.run(gpu, &mut encoder, of, groups);
        }
        self.kernels.learn.run(gpu, &mut encoder, of, groups);
        if let Some(coat) = coat {
            coat.learn.run(gpu, &mut encoder, of, groups);
        }
        gpu.queue.submit([encoder.finish()]);
        Ok(())
    }

    /// Forward and adjoint of rays that may bend and be mirrored, portion by portion.
    fn learn_bent(
        &self,
        bending: Bending,
        task: Task,
        objective: &Objective,
        of: &[&Buffers],
        found: &mut Found,
    ) -> Result<(), GpuError> {
        let (gpu, kernels) = (&self.gpu, self.kernels.bent(&self.gpu)?);
        let source = reflections::source(&self.held, Layers::All);
        let mut encoder = self.encoder();
        clear(&mut encoder, &self.buffers, "index_gradient");
        gpu.queue.submit([encoder.finish()]);
        for portion in bending.portions(task.rays as usize) {
            let forward = Forward { portion, task, source, marching: objective.marching, of };
            let blocks = self.forward(&forward, found)?;
            let all: Vec<&Buffers> = of.iter().copied().chain([&found.buffers]).collect();
            if task.wants & MIRRORS != 0 {
                let mut encoder = self.encoder();
                let rays = workgroups(portion.rays as usize);
                self.kernels.mirrors(gpu)?.vjp.run(gpu, &mut encoder, &all, rays);
                gpu.queue.submit([encoder.finish()]);
            }
            follow_back(gpu, &kernels.learn, &all, &portion, blocks);
        }
        Ok(())
    }

    /// The step of what bends rays, absorbs and mirrors, which the host takes: its grids are small. Not after a failure.
    fn move_bodies(&mut self, objective: &Objective, step: u64, outcome: usize) -> Result<(), GpuError> {
        if self.held.refraction.is_none() && self.held.clearcoat.is_none() {
            return Ok(());
        }
        let at = 4 * (OUTCOME_WORDS * outcome) as u64;
        let sums = self.host_sums("outcomes", at, OUTCOME_WORDS)?;
        let [_, _, _, failed, _, cut, rays, ..] = sums.words[..] else { return Ok(()) };
        if cut != 0 {
            return Err(GpuError::cut_short(&self.gpu));
        }
        if failed != 0 {
            return Ok(());
        }
        let HostSums { medium: (gradient, absorption), mirrored, .. } = sums;
        let (refraction, moments) = (&mut self.held.refraction, &mut self.moments.index[..]);
        let learned = descent::IndexStep { gradient, rays: rays as usize, step };
        let index = objective.index.as_ref();
        let is_index_finite = index.is_none_or(|o| descent::update_index(refraction, moments, learned, o));
        let absorbing = objective.absorption.as_ref();
        let is_absorption_finite =
            absorbing.is_none_or(|o| descent::update_absorption(refraction, moments, &absorption, o));
        let (reflection, moments) = (&mut self.held.reflection, &mut self.moments.reflection[..]);
        let mirroring = objective.reflection.as_ref();
        let are_mirrors_finite =
            mirroring.is_none_or(|o| descent::update_mirrors(reflection, moments, &mirrored.mirrors, o));
        let (clearcoat, moments) = (&mut self.held.clearcoat, &mut self.moments.clearcoat);
        let coat = mirroring.zip(clearcoat.as_mut()).zip(mirrored.clearcoat.as_ref());
        let is_coat_finite = coat.is_none_or(|((o, coat), d)| descent::update_clearcoat(coat, moments, d, o));
        if !(is_index_finite && is_absorption_finite && are_mirrors_finite && is_coat_finite) {
            let words = OUTCOME_WORDS * outcome + 3;
            self.buffers.write_at(&self.gpu, "outcomes", 4 * words as u64, &[1_u32]);
            self.buffers.write_at(&self.gpu, "status", 4 * u64::from(STATUS_FAILED), &[1_u32]);
        }
        if mirroring.is_some() {
            reflections::upload(&self.gpu, &mut self.buffers, &self.held)?;
        }
        if self.held.refraction.is_none() {
            return Ok(());
        }
        bodies::upload(&self.gpu, &mut self.buffers, &self.held.refraction)
    }

    /// The sums of the gradient of what the host moves, and so many words of the array `name` from the byte `offset`: all in one
    /// read-back.
    fn host_sums(&self, name: &str, offset: u64, words: usize) -> Result<HostSums, GpuError> {
        let refraction = &self.held.refraction;
        let index = if refraction.is_none() { 0 } else { bodies::gradient_len(refraction) };
        let mirrored = reflections::gradient_len(&self.held);
        let parts = [
            (name, offset, 4 * words),
            ("index_gradient", 0, 8 * index),
            ("probe_gradient", 0, 8 * mirrored),
        ];
        let [words, index, mirrored] = self.buffers.read_parts(&self.gpu, parts)?;
        let sums = |bytes: &[u8]| -> Vec<f64> {
            let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(bytes);
            words.iter().map(|w| from_fixed(w[0], w[1])).collect()
        };
        Ok(HostSums {
            words: bytemuck::pod_collect_to_vec(&words),
            medium: bodies::gradient(refraction, &sums(&index)),
            mirrored: reflections::Gradient::of(&self.held, &sums(&mirrored)),
        })
    }

    /// Forward and adjoint of a batch without a step; of the rays alone, where the field is not wanted.
    pub(crate) fn look_back(
        &self,
        batch: &Batch,
        objective: &Objective,
        wants: u32,
    ) -> Result<Gradients, GpuError> {
        let (gpu, mut room) = (&self.gpu, Room::default());
        room.rays.fill(gpu, &Lesson::of_batch(batch, &self.held.refraction), true)?;
        let mut task = Task::learning(objective, &self.held, Given::of(batch));
        task.wants = (task.wants & !(WANTS_FIELD | WANTS_INDEX)) | WANTS_RAYS | wants;
        self.learn(task, objective, Adjoints::Whole, &mut room)?;
        let sums = self.host_sums("status", 0, STATUS_WORDS as usize)?;
        let HostSums { words: status, medium: (medium, absorption), mirrored } = sums;
        if status[STATUS_CUT as usize] != 0 {
            return Err(GpuError::cut_short(gpu));
        }
        let outcome = StepOutcome {
            rays: batch.rays.len() as u64,
            squared_error: from_fixed(status[STATUS_ERROR as usize], status[STATUS_ERROR as usize + 1]),
            samples: status[STATUS_SAMPLES as usize].into(),
            overflows: status[STATUS_OVERFLOWS as usize].into(),
            finite: status[STATUS_LOSS as usize] == 0,
            step: 0,
        };
        let adjoints: Vec<RayAdjoint> = room.rays.buffers.read(gpu, "ray_gradients", batch.rays.len())?;
        let rays = adjoints.into_iter().map(RayGradient::from).collect();
        let (field, texels) = self.sums(wants & WANTS_FIELD != 0)?;
        self.clear_sums();
        Ok(Gradients { field, texels, medium, absorption, mirrored, rays, outcome })
    }

    /// The sums of gradients as they are; empty ones of a field that is not wanted.
    fn sums(&self, wants_field: bool) -> Result<(FieldGradient<f32>, Vec<[f32; 3]>), GpuError> {
        let (gpu, shape, field) = (&self.gpu, &self.kernels.shape, &self.held.field);
        let numbers = |name: &str, n: usize| -> Result<Vec<f32>, GpuError> {
            let words: Vec<[u32; 2]> = self.buffers.read(gpu, name, n)?;
            Ok(words.iter().map(|w| from_fixed(w[0], w[1]) as f32).collect())
        };
        let texels = numbers("texel_gradient", texel_values(&self.held.background))?;
        let texels = texels.as_chunks::<3>().0.to_vec();
        if !wants_field {
            let none = || AlignedVec::from_slice(&[]);
            return Ok((FieldGradient { density: none(), colour: none() }, texels));
        }
        let (voxels, stride, lanes) = (field.map.voxels(), field.degree.stride(), shape.lanes());
        let density = AlignedVec::from_slice(&numbers("density_gradient", voxels)?);
        let mut colour = AlignedVec::filled(voxels * stride, 0.0);
        for k in 0..shape.gradient.pools {
            let range = shape.gradient.range(k, voxels);
            let part = numbers(&format!("colour_gradient_{k}"), range.len() * lanes)?;
            for (voxel, d) in range.zip(part.chunks_exact(lanes)) {
                colour[voxel * stride..voxel * stride + lanes].copy_from_slice(d);
            }
        }
        Ok((FieldGradient { density, colour }, texels))
    }

    /// Sums are 0 again; what failed before stays.
    fn clear_sums(&self) {
        let mut encoder = self.encoder();
        for (name, _) in gradients(&self.kernels.shape, &self.held) {
            clear(&mut encoder, &self.buffers, &name);
        }
        if let Some(status) = self.buffers.get("status") {
            encoder.clear_buffer(status, 4 * u64::from(STATUS_LOSS), None);
        }
        self.gpu.queue.submit([encoder.finish()]);
    }

    /// The outcomes of the steps that were enqueued and not read yet.
    pub(crate) fn read_outcomes(&mut self) -> Result<Vec<StepOutcome>, GpuError> {
        let all: Vec<[u32; OUTCOME_WORDS]> = self.buffers.read(&self.gpu, "outcomes", self.pending.len())?;
        if all.iter().any(|words| words[5] != 0) {
            return Err(GpuError::cut_short(&self.gpu));
        }
        let outcome = |(&(step, _), words): (&(u64, u64), &[u32; OUTCOME_WORDS])| {
            let [low, high, samples, failed, overflows, _, rays, _] = *words;
            let (squared_error, samples) = (from_fixed(low, high), samples.into());
            StepOutcome {
                step,
                rays: rays.into(),
                squared_error,
                samples,
                overflows: overflows.into(),
                finite: failed == 0,
            }
        };
        Ok(std::mem::take(&mut self.pending).iter().zip(&all).map(outcome).collect())
    }
}

/// Set an array to 0.
fn clear(encoder: &mut wgpu::CommandEncoder, buffers: &Buffers, name: &str) {
    if let Some(buffer) = buffers.get(name) {
        encoder.clear_buffer(buffer, 0, None);
    }
}
