//! What bends the rays of a model: its index of refraction, and how rays are traced through it.

use refraxel_core::optics::{Options, Tracer};
use refraxel_core::{Domain, Integrator, Medium, Ray, Vec3};

/// The refractive part of a model. Without regions, all rays are straight.
#[derive(Clone, Debug)]
pub struct Refraction {
    /// The index of refraction.
    pub medium: Medium<f32>,
    /// Per region and node: whether the index may be learned there; empty for everywhere.
    pub free: Vec<Vec<bool>>,
    /// How rays are traced.
    pub optics: Optics,
}

/// How rays are traced through the index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optics {
    /// How a step is made.
    pub integrator: Integrator,
    /// Longest step [voxel of the index grid].
    pub step: f32,
}

impl Default for Optics {
    fn default() -> Self {
        Self { integrator: Integrator::default(), step: 0.5 }
    }
}

/// Segments of a path before it is given up: a ray caught in a light guide.
const MAX_SEGMENTS: usize = 2048;

impl Refraction {
    /// Straight rays.
    pub fn none() -> Self {
        let medium = Medium::new(Vec::new()).unwrap_or_else(|_| unreachable!("no two regions overlap"));
        Self { medium, free: Vec::new(), optics: Optics::default() }
    }

    /// True when all rays are straight.
    pub fn is_none(&self) -> bool {
        self.medium.regions().is_empty()
    }

    /// Whether a ray may bend: it meets a region.
    pub fn admits(&self, ray: &Ray<f32>) -> bool {
        self.medium.regions().iter().any(|r| r.domain().bounds.clip(ray).is_some())
    }

    /// The index of refraction at a point.
    pub fn index(&self, x: Vec3<f32>) -> f32 {
        self.medium.index(x)
    }

    /// A tracer of rays that are seen inside `domain` from `near` on [scene unit].
    pub fn tracer<'a>(&'a self, domain: &'a Domain<f32>, near: f32) -> Tracer<'a, f32> {
        let Optics { integrator, step } = self.optics;
        Tracer::new(&self.medium, domain, Options { integrator, step, near, max_segments: MAX_SEGMENTS })
    }
}

/// placeholder
pub fn gaussian_blur(_values: &mut [f32], _resolution: [u32; 3], _sigma: f32) {}
