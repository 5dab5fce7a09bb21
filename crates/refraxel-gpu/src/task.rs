//! What kernels are told in one dispatch: the uniform `Task`, and rays.

use crate::constants::{GIVEN_BEHIND, WANTS_FIELD};
use bytemuck::{Pod, Zeroable};
use refraxel_core::{Ray, Vec3, VoxelField};
use refraxel_train::backend::{Batch, Marching, Objective, RayGradient};

/// `Task` of `scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Task {
    pub rays: u32,
    pub wants: u32,
    step: f32,
    near: f32,
    theta_min: f32,
    min_transmittance: f32,
    sparsity: f32,
    opacity: f32,
    tv_density: f32,
    tv_colour: f32,
    tv_period: u32,
    pub tv_turn: u32,
    rate_density: f32,
    rate_colour: f32,
    rate_view: f32,
    rate_background: f32,
    pub outcome: u32,
    padding: [u32; 3],
}

impl Task {
    /// Marching alone.
    pub(crate) fn marching(marching: &Marching, field: &VoxelField<f32>, rays: usize) -> Self {
        Self {
            rays: rays as u32,
            step: marching.step * field.domain.voxel(),
            near: marching.near,
            theta_min: marching.theta_min(field),
            min_transmittance: marching.min_transmittance,
            ..Self::default()
        }
    }

    /// A step, or the gradient of one.
    pub(crate) fn learning(objective: &Objective, field: &VoxelField<f32>, batch: &Batch) -> Self {
        let given = if batch.behind.is_empty() { 0 } else { GIVEN_BEHIND };
        Self {
            wants: WANTS_FIELD | given,
            sparsity: objective.sparsity,
            opacity: objective.opacity,
            tv_density: objective.tv_density,
            tv_colour: objective.tv_colour,
            tv_period: objective.tv_period,
            rate_density: objective.rate_density,
            rate_colour: objective.rate_colour,
            rate_view: objective.rate_view,
            rate_background: objective.rate_background,
            ..Self::marching(&objective.marching, field, batch.rays.len())
        }
    }
}

/// `Lesson` of `rays.wgsl`: a ray with what it should show.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Lesson {
    origin: [f32; 3],
    offset: f32,
    direction: [f32; 3],
    pub bends: u32,
    colour: [f32; 3],
    padding_1: f32,
    behind: [f32; 3],
    padding_2: f32,
}

impl Lesson {
    /// Rays whose points lie in the middle of their steps.
    pub(crate) fn of_rays(rays: &[Ray<f32>]) -> Vec<Self> {
        let lesson = |ray: &Ray<f32>| Self {
            origin: ray.origin.to_array(),
            direction: ray.direction.to_array(),
            offset: 0.5,
            ..Self::default()
        };
        rays.iter().map(lesson).collect()
    }

    /// The rays of a batch.
    pub(crate) fn of_batch(batch: &Batch) -> Vec<Self> {
        let mut lessons = Self::of_rays(&batch.rays);
        for (k, lesson) in lessons.iter_mut().enumerate() {
            (lesson.offset, lesson.colour) = (batch.offset[k], batch.target[k]);
            lesson.behind = batch.behind.get(k).copied().unwrap_or_default();
        }
        lessons
    }
}

/// `Seen` of `rays.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct Seen {
    pub colour: [f32; 3],
    pub transmittance: f32,
    pub behind: [f32; 3],
    pub depth: f32,
}

/// `RayGradient` of `ray_gradient.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(crate) struct RayAdjoint {
    origin: [f32; 3],
    padding_0: f32,
    direction: [f32; 3],
    padding_1: f32,
    residual: [f32; 3],
    padding_2: f32,
}

impl From<RayAdjoint> for RayGradient {
    fn from(d: RayAdjoint) -> Self {
        let vector = |v: [f32; 3]| Vec3::from(v);
        Self { origin: vector(d.origin), direction: vector(d.direction), residual: d.residual }
    }
}
