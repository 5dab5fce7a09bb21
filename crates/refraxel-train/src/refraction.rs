//! What bends the rays of a model: its index of refraction, and how rays are traced through it.

use crate::initial::Gate;
use refraxel_core::optics::{Options, Tracer};
use refraxel_core::{Domain, IndexGrid, Integrator, Medium, Ray, Vec3};

/// The refractive part of a model. Without regions, all rays are straight.
#[derive(Clone, Debug)]
pub struct Refraction {
    /// The index of refraction.
    pub medium: Medium<f32>,
    /// One per region.
    pub extras: Vec<Extras>,
    /// How rays are traced.
    pub optics: Optics,
}

/// What a region has besides its index.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extras {
    /// Per node: whether the index may be learned there; empty for everywhere.
    pub free: Vec<bool>,
    /// Which rays bend; absent for all that meet the region's box.
    pub gate: Option<Gate>,
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
        Self { medium, extras: Vec::new(), optics: Optics::default() }
    }

    /// True when all rays are straight.
    pub fn is_none(&self) -> bool {
        self.medium.regions().is_empty()
    }

    /// Whether a ray bends: the straight ray meets something refractive.
    #[inline]
    pub fn admits(&self, ray: &Ray<f32>) -> bool {
        self.medium.regions().iter().enumerate().any(|(k, region)| {
            match self.extras.get(k).and_then(|e| e.gate.as_ref()) {
                Some(gate) => gate.admits(ray),
                None => region.domain().bounds.clip(ray).is_some(),
            }
        })
    }

    /// The nodes of a region where the index may be learned; `None` for all.
    pub fn free(&self, region: usize) -> Option<&[bool]> {
        self.extras.get(region).map(|e| &e.free[..]).filter(|free| !free.is_empty())
    }

    /// The index of refraction at a point.
    pub fn index(&self, x: Vec3<f32>) -> f32 {
        self.medium.index(x)
    }

    /// Find again which cells rays can hop over: flat ones that are not to be learned.
    pub fn find_flat_cells(&mut self) {
        for region in 0..self.medium.regions().len() {
            let free = self.extras.get(region).map(|e| &e.free[..]).filter(|free| !free.is_empty());
            self.medium.region_mut(region).find_flat_cells(free);
        }
    }

    /// Mean index where it is above 1, weighted by how much, per region: the index of a homogeneous body whatever its size.
    pub fn mean_indices(&self) -> Vec<f64> {
        let mean = |grid: &IndexGrid<f32>| {
            if let (Some(n), Some(_)) = (grid.interior_index(), grid.level_set()) {
                return n.into();
            }
            let (mut sum, mut weight) = (0.0, 0.0);
            for &c in grid.coefficients() {
                let above = f64::from((2.0 * c).sqrt()) - 1.0;
                sum += above * above;
                weight += above;
            }
            if weight > 0.0 { 1.0 + sum / weight } else { 1.0 }
        };
        self.medium.regions().iter().map(mean).collect()
    }

    /// A tracer of rays that are seen inside `domain` from `near` on [scene unit].
    pub fn tracer<'a>(&'a self, domain: &'a Domain<f32>, near: f32) -> Tracer<'a, f32> {
        let Optics { integrator, step } = self.optics;
        Tracer::new(&self.medium, domain, Options { integrator, step, near, max_segments: MAX_SEGMENTS })
    }
}
