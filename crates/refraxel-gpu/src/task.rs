//! What kernels are told in one dispatch: the uniform `Task`, and rays.

use crate::constants::{ABSORBS, GIVEN_BEHIND, WANTS_FIELD, WANTS_INDEX, WANTS_PATHS};
use bytemuck::{Pod, Zeroable};
use refraxel_core::radiance::Pixel;
use refraxel_core::{Ray, Vec3};
use refraxel_train::backend::{Batch, Marching, Objective, RayGradient};
use refraxel_train::{Model, Refraction};

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
    sample_colour: f32,
    tv_density: f32,
    tv_colour: f32,
    tv_period: u32,
    pub tv_turn: u32,
    rate_density: f32,
    rate_colour: f32,
    rate_view: f32,
    rate_background: f32,
    pub outcome: u32,
    thin: f32,
    full_distance: f32,
    padding: [u32; 2],
}

impl Task {
    /// Marching alone.
    pub(crate) fn marching(marching: &Marching, model: &Model, rays: usize) -> Self {
        let field = &model.field;
        Self {
            rays: rays as u32,
            wants: if model.refraction.is_absorbing() { ABSORBS } else { 0 },
            step: marching.step * field.domain.voxel(),
            near: marching.near,
            theta_min: marching.theta_min(field),
            min_transmittance: marching.min_transmittance,
            ..Self::default()
        }
    }

    /// Drawing rays, from photographs of their own exposures or not.
    pub(crate) fn drawing(rays: usize, are_exposed: bool) -> Self {
        Self { rays: rays as u32, wants: if are_exposed { ABSORBS } else { 0 }, ..Self::default() }
    }

    /// A step, or the gradient of one.
    pub(crate) fn learning(objective: &Objective, model: &Model, given: Given) -> Self {
        let marching = Self::marching(&objective.marching, model, given.rays);
        let bit = |wanted: bool, bit: u32| if wanted { bit } else { 0 };
        let bends = !model.refraction.is_none();
        Self {
            wants: marching.wants
                | WANTS_FIELD
                | bit(given.behind, GIVEN_BEHIND)
                | bit(bends, WANTS_PATHS)
                | bit(bends && objective.index.is_some(), WANTS_INDEX)
                | bit(bends && objective.absorption.is_some(), ABSORBS),
            thin: objective.thin,
            full_distance: objective.full_distance,
            sample_colour: if given.behind { 0.0 } else { objective.sample_colour },
            tv_density: objective.tv_density,
            tv_colour: objective.tv_colour,
            tv_period: objective.tv_period,
            rate_density: objective.rate_density,
            rate_colour: objective.rate_colour,
            rate_view: objective.rate_view,
            rate_background: objective.rate_background,
            ..marching
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
    bends: u32,
    colour: [f32; 3],
    beside: u32,
    behind: [f32; 3],
    is_absent: u32,
}

/// What a batch on a device is like.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Given {
    /// Rays, and room for those that could not be drawn.
    pub rays: usize,
    /// The radiance behind the field comes with them.
    pub behind: bool,
}

impl Given {
    /// What a batch of the host is like.
    pub(crate) fn of(batch: &Batch) -> Self {
        Self { rays: batch.rays.len(), behind: !batch.behind.is_empty() }
    }
}

impl Lesson {
    /// Rays whose points lie in the middle of their steps.
    pub(crate) fn of_rays(rays: &[Ray<f32>], refraction: &Refraction) -> Vec<Self> {
        let lesson = |ray: &Ray<f32>| Self {
            origin: ray.origin.to_array(),
            direction: ray.direction.to_array(),
            bends: refraction.admits(ray).into(),
            offset: 0.5,
            ..Self::default()
        };
        rays.iter().map(lesson).collect()
    }

    /// The rays of a batch.
    pub(crate) fn of_batch(batch: &Batch, refraction: &Refraction) -> Vec<Self> {
        let mut lessons = Self::of_rays(&batch.rays, refraction);
        for (k, lesson) in lessons.iter_mut().enumerate() {
            (lesson.offset, lesson.colour) = (batch.offset[k], batch.target[k]);
            lesson.beside = batch.is_beside(k).into();
            lesson.behind = batch.behind.get(k).copied().unwrap_or_default();
        }
        lessons
    }
}

/// A batch as it lies on a device, without rays that could not be drawn, and which of them may bend.
pub(crate) fn batch_of(lessons: &[Lesson], given: Given) -> (Batch, Vec<bool>) {
    let (mut batch, mut bends) = (Batch::default(), Vec::new());
    for l in lessons.iter().filter(|l| l.is_absent == 0) {
        batch.rays.push(Ray { origin: l.origin.into(), direction: l.direction.into() });
        batch.target.push(l.colour);
        batch.offset.push(l.offset);
        batch.beside.push(l.beside != 0);
        batch.behind.extend(given.behind.then_some(l.behind));
        bends.push(l.bends != 0);
    }
    (batch, bends)
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

impl From<Seen> for Pixel<f32> {
    fn from(s: Seen) -> Self {
        Self { colour: s.colour, transmittance: s.transmittance, depth: s.depth }
    }
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
