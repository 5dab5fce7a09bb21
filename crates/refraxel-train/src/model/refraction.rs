//! What bends the rays of a model: its index of refraction, and how rays are traced through it.

use super::Gate;
use super::polyhedron::{Plane, Polyhedron};
use refraxel_core::optics::{Options, Tracer};
use refraxel_core::{Domain, IndexGrid, Integrator, Medium, Path, Ray, Vec3};

/// The refractive part of a model. Without regions, all rays are straight.
#[derive(Clone, Debug)]
pub struct Refraction {
    /// The index of refraction.
    pub medium: Medium<f32>,
    /// One per region.
    pub states: Vec<RegionState>,
    /// How rays are traced.
    pub optics: Optics,
}

/// What a region has besides its index.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RegionState {
    /// Per node: whether the index may be learned there; empty for everywhere.
    pub trainable: Vec<bool>,
    /// Which rays bend; absent for all that meet the region's box.
    pub gate: Option<Gate>,
    /// The index that a search found for the whole body, where it found one.
    pub searched: Option<f32>,
    /// The index is held as it is, as that of the air in a bubble; the surface may still learn.
    pub fixed_index: bool,
    /// The surface is held as it is, as that of a thin wall, which what single pixels want would dent; the index may still
    /// learn.
    pub fixed_surface: bool,
    /// The planes of a body whose faces are all flat: they learn, and not the nodes of its surface.
    pub solid: Option<Polyhedron>,
    /// Planes that cut a body with other faces, too: they are held.
    pub cuts: Vec<Plane>,
}

impl RegionState {
    /// The nodes where the index may be learned; `None` for all.
    pub fn trainable(&self) -> Option<&[bool]> {
        Some(&self.trainable[..]).filter(|nodes| !nodes.is_empty())
    }
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
pub const MAX_SEGMENTS: usize = 2048;
/// Segments of a secondary path between sharp surfaces. From within a ball of glass two thirds of all directions are caught
/// for ever.
const MAX_BOUNCES: usize = 24;

impl Refraction {
    /// Straight rays.
    pub fn none() -> Self {
        Self::of(Vec::new())
    }

    /// Rays that these regions bend, of which all may be learned.
    ///
    /// # Panics
    /// If they are no [`Medium`].
    pub fn of(regions: Vec<IndexGrid<f32>>) -> Self {
        let states = vec![RegionState::default(); regions.len()];
        let medium = Medium::new(regions).unwrap_or_else(|e| panic!("regions that are no medium: {e}"));
        Self { medium, states, optics: Optics::default() }
    }

    /// True when all rays are straight.
    pub fn is_none(&self) -> bool {
        self.medium.regions().is_empty()
    }

    /// True when some body is tinted.
    pub fn is_absorbing(&self) -> bool {
        self.medium.regions().iter().any(|r| r.absorption() != [0.0; 3])
    }

    /// What a ray has to meet to bend in a region; `None`: its box.
    pub fn gate(&self, region: usize) -> Option<&Gate> {
        self.states.get(region).and_then(|state| state.gate.as_ref())
    }

    /// Whether a ray bends: the straight ray meets something refractive.
    #[inline]
    pub fn admits(&self, ray: &Ray<f32>) -> bool {
        self.medium.regions().iter().enumerate().any(|(k, region)| match self.gate(k) {
            Some(gate) => gate.admits(ray),
            None => region.domain().bounds.clip(ray).is_some(),
        })
    }

    /// Whether the path of a ray truly turns somewhere.
    pub fn turns(&self, ray: &Ray<f32>, domain: &Domain<f32>, path: &mut Path<f32>) -> bool {
        /// Square of the sine of the least angle that counts.
        const LEAST: f32 = 1e-8;
        if !self.admits(ray) {
            return false;
        }
        self.tracer(domain, 0.0).trace_into(ray, path);
        let d = ray.direction;
        let turned = |p: Vec3<f32>| {
            let sine = p.cross(d);
            sine.dot(sine) > LEAST * p.dot(p)
        };
        path.segments.iter().any(|s| turned(s.momentum))
    }

    /// Whether most of the rays that turn meet something that mirrors, theory (7.1) and (7.11).
    pub fn mirrors(&self, rays: &[Ray<f32>], domain: &Domain<f32>) -> bool {
        let (mut path, mut found) = (Path::default(), Vec::new());
        let (mut turned, mut mirrored) = (0, 0);
        for ray in rays {
            if self.turns(ray, domain, &mut path) {
                self.tracer(domain, 0.0).partial_reflections(&path, &mut found);
                turned += 1;
                mirrored += usize::from(!found.is_empty());
            }
        }
        2 * mirrored > turned
    }

    /// The index of refraction at a point.
    pub fn index(&self, x: Vec3<f32>) -> f32 {
        self.medium.index(x)
    }

    /// Find again which cells rays can hop over: flat ones that are not to be learned.
    pub fn find_flat_cells(&mut self) {
        for region in 0..self.medium.regions().len() {
            let trainable = self.states.get(region).and_then(RegionState::trainable);
            self.medium.region_mut(region).find_flat_cells(trainable);
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

    /// What each region absorbs of red, green and blue [1 / scene unit]; empty where all are clear.
    pub fn absorption(&self) -> Vec<[f32; 3]> {
        let regions = self.medium.regions().iter().filter(|_| self.is_absorbing());
        regions.map(IndexGrid::absorption).collect()
    }

    /// A tracer of rays that are seen inside `domain` from `near` on [scene unit].
    pub fn tracer<'a>(&'a self, domain: &'a Domain<f32>, near: f32) -> Tracer<'a, f32> {
        self.tracer_of(domain, near, MAX_SEGMENTS)
    }

    /// A tracer of rays that begin anywhere: one that begins inside a body may never find out, and is given up sooner.
    pub fn secondary_tracer<'a>(&'a self, domain: &'a Domain<f32>) -> Tracer<'a, f32> {
        self.tracer_of(domain, 0.0, self.secondary_segments())
    }

    /// The most segments of the path of such a ray.
    pub fn secondary_segments(&self) -> usize {
        let graded = self.medium.regions().iter().any(|r| r.interior_index().is_none());
        if graded { MAX_SEGMENTS / 4 } else { MAX_BOUNCES }
    }

    fn tracer_of<'a>(&'a self, domain: &'a Domain<f32>, near: f32, max_segments: usize) -> Tracer<'a, f32> {
        let Optics { integrator, step } = self.optics;
        Tracer::new(&self.medium, domain, Options { integrator, step, near, max_segments })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, Interpolation, LevelSet, vec3};

    fn of_grid(grid: IndexGrid<f32>) -> Refraction {
        let trainable = vec![true; grid.coefficients().len()];
        let states = vec![RegionState { trainable, ..RegionState::default() }];
        Refraction { states, ..Refraction::of(vec![grid]) }
    }

    #[test]
    fn surfaces_mirror_and_a_lens_does_not() {
        let cube = Aabb::cube(1.0);
        let domain = Domain::with_longest(cube, refraxel_core::Extent::Bounded, 16);
        let rays: Vec<Ray<f32>> = (0..20)
            .map(|k| Ray { origin: vec3(-3.0, 0.04 * k as f32, 0.1), direction: vec3(1.0, 0.0, 0.0) })
            .collect();
        let smooth = |n: &dyn Fn(f32) -> f32| {
            let of = |x: Vec3<f32>| n(x.length());
            of_grid(IndexGrid::from_control_values(cube, [41; 3], Interpolation::CubicBSpline, of))
        };
        let lens = smooth(&|r| (2.0 - (r / 0.8).powi(2).min(1.0)).sqrt());
        let ball = smooth(&|r| 1.25 - 0.25 * ((r - 0.6) / 0.04).tanh());
        let sharp = of_grid(IndexGrid::sharp(
            LevelSet::from_samples(cube, [33; 3], |x: Vec3<f32>| x.length() - 0.6),
            1.5,
        ));
        assert!(ball.mirrors(&rays, &domain) && sharp.mirrors(&rays, &domain));
        assert!(!lens.mirrors(&rays, &domain) && !Refraction::none().mirrors(&rays, &domain));
    }

    #[test]
    fn the_mean_index_of_a_body_is_its_index_whatever_its_size() {
        let cube = Aabb::cube(1.0);
        let ball = |x: Vec3<f32>| if x.length() < 0.5 { 1.4 } else { 1.0 };
        let smooth = IndexGrid::from_control_values(cube, [33; 3], Interpolation::CubicBSpline, ball);
        assert!((of_grid(smooth).mean_indices()[0] - 1.4).abs() < 1e-5);
        assert!(Refraction::none().mean_indices().is_empty());
    }
}
