//! How a chunk sees a scene.

use super::clearcoat::OpaqueSurface;
use super::scene::Scene;
use crate::backend::Marching;
use refraxel_core::optics::Tracer;

/// How a chunk traces its rays.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub scene: &'a Scene<'a>,
    pub marching: &'a Marching,
    /// As [`Objective::thin`](crate::backend::Objective::thin).
    pub thin: f32,
    /// Absent when all rays are straight.
    pub tracer: Option<Tracer<'a, f32>>,
    /// Colours pass what absorbs; otherwise nothing does, and nothing shall learn to.
    pub absorbing: bool,
}

impl<'a> View<'a> {
    pub(super) fn new(scene: &'a Scene<'a>, marching: &'a Marching) -> Self {
        let tracer = (!scene.refraction.is_none())
            .then(|| scene.refraction.tracer(scene.marcher.domain(), marching.near));
        Self { scene, marching, thin: 0.0, tracer, absorbing: scene.refraction.is_absorbing() }
    }

    /// The tracer, where surfaces mirror.
    #[inline(always)]
    pub(super) fn mirroring(&self) -> Option<&Tracer<'a, f32>> {
        self.tracer.as_ref().filter(|_| !self.scene.reflection.is_none())
    }

    /// The surfaces of opaque things, where they have a clearcoat.
    #[inline(always)]
    pub(super) fn opaque_surface(&self) -> Option<OpaqueSurface<'a>> {
        let (scene, least) = (self.scene, self.marching.min_optical_depth);
        scene.clearcoat.map(|clearcoat| OpaqueSurface { scene, clearcoat, least })
    }
}
