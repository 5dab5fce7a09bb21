//! Bent rays: the ray equation d/ds(n dx/ds) = ∇n, theory (2.1), integrated through a [`Medium`], and its exact adjoint.
//!
//! With the optical momentum p = n dx/ds and the parameter dt = ds/n it reads dx/dt = p, dp/dt = ∇w with w = n²/2,
//! theory (2.2), and |p|² = 2w stays true along a ray, theory (2.3). A [`Path`] is a list of straight
//! [`Segment`]s: *kicks* change p at points, *drifts* of length h in t join them.
//!
//! Where the field is flat there is nothing to kick. Inside a region such points are passed on the same lattice of steps,
//! many in one segment: the result is that of marching them all. Outside all regions, and through the flat rim of their
//! boxes, one segment leads to the next cell that is not flat, or to the end of the scene.
//!
//! ```
//! use refraxel_core::optics::Options;
//! use refraxel_core::{Aabb, Domain, Extent, IndexGrid, Interpolation, Medium, Ray, Tracer, Vec3, vec3};
//! // A ball of glass, n = 1.5, of radius 20 voxels with a soft edge; a ray at impact b = 10.
//! let cube = Aabb::new(Vec3::splat(-28.0), Vec3::splat(28.0));
//! let n = |x: Vec3<f64>| 1.25 - 0.25 * (x.length() - 20.0).tanh();
//! let ball = IndexGrid::from_control_values(cube, [57; 3], Interpolation::CubicBSpline, n);
//! let (medium, domain) = (Medium::new(vec![ball])?, Domain::with_longest(cube, Extent::Bounded, 57));
//! let ray = Ray { origin: vec3(-40.0, 10.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
//! let path = Tracer::new(&medium, &domain, Options::default()).trace(&ray);
//! // Snell: 2 (asin(b/R) − asin(b/nR)) = 0.3675 towards the axis.
//! let deflection = -path.exit.direction.y.asin();
//! assert!((deflection - 0.3675).abs() < 0.01, "{deflection}");
//! # Ok::<(), refraxel_core::index::Overlap>(())
//! ```
//!
//! Where a region has a [`LevelSet`](crate::LevelSet) the index jumps at its surface: an [`Event`], theory (2.25), ends the
//! segment there and turns p by Snell's law. The same ball with a sharp edge, exact to 1e-4 degrees:
//!
//! ```
//! use refraxel_core::optics::{Options, RayAdjoint};
//! use refraxel_core::{Aabb, Domain, Extent, IndexGrid, LevelSet, Medium, Ray, Tracer, Vec3, vec3};
//! let cube = Aabb::new(Vec3::splat(-28.0), Vec3::splat(28.0));
//! let surface = LevelSet::from_samples(cube, [57; 3], |x: Vec3<f64>| x.length() - 20.0);
//! let mut medium = Medium::new(vec![IndexGrid::sharp(surface, 1.5)])?;
//! let domain = Domain::with_longest(cube, Extent::Bounded, 57);
//! let ray = Ray { origin: vec3(-40.0, 10.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
//! let mut gradient = medium.zero_gradient();
//! let tracer = Tracer::new(&medium, &domain, Options::default());
//! let path = tracer.trace(&ray);
//! assert!((path.exit.direction.y.asin() + 0.36752).abs() < 1e-5);
//! // d(exit.y)/d(everything); no radiance along the segments.
//! let none = vec![(Vec3::zero(), Vec3::zero()); path.segments.len()];
//! let d_exit = RayAdjoint { origin: Vec3::zero(), direction: vec3(0.0, 1.0, 0.0) };
//! tracer.vjp(&ray, &path, &none, &d_exit, &mut gradient);
//! // By the index: cos(0.3675) × −2 b/(n²R √(1 − (b/nR)²)) = −0.4399.
//! let by_index: f64 = 1.5 * gradient.index[0].iter().sum::<f64>();
//! assert!((by_index + 0.4399).abs() < 1e-3, "{by_index}");
//! // A step of descent on the surface.
//! let body = medium.region_mut(0).level_set_mut().unwrap();
//! for (c, d) in body.coefficients_mut().iter_mut().zip(&gradient.level_set[0]) {
//!     *c -= 0.1 * d;
//! }
//! body.smooth(0.03);
//! body.redistance();
//! # Ok::<(), refraxel_core::index::Overlap>(())
//! ```
//!
//! **What is held fixed in derivatives.** The lengths h of steps and hops, their number, the clipping of segments by the
//! radiance domain, and where the camera is: in which region, behind which near plane. They are the discretisation, as t
//! and dt are for quadrature. The crossing of a surface is not: its t moves with the ray and with the surface, and so does
//! all that follows; only the end of the segment's own range stays, theory (2.30). [`Tracer::vjp`] is the exact transpose of the derivative of [`Tracer::replay`]. Letting
//! hops end on the faces of cells instead would add terms proportional to the kick there, and ∇w vanishes at the end
//! of a flat cell: it only shifts the lattice, on which the exit ray depends by O(h²). Against central differences of [`Tracer::trace`],
//! which chooses its steps again, derivatives of the exit direction by the origin are off by 1.5e-2, 3.6e-3 and 9e-4 (median)
//! at steps of 0.5, 0.25 and 0.125 voxel: ball of 49³ nodes, edge of 1 voxel, cubic. What is transported is the basic
//! radiance L/n², which is invariant along a ray: no factor appears where n changes.

mod adjoint;
mod body;
mod crossing;
mod event;
pub mod fresnel;
mod gradual;
mod hop;
mod mirror;
mod step;
mod trace;

#[cfg(test)]
mod tests;

pub use event::{Event, EventKind, GRAZING};
pub use fresnel::Weight;
pub use mirror::{PartialReflection, PartialReflectionAdjoint};

use crate::radiance::Segment;
use crate::{Domain, Medium, Ray, Real, Vec3};

/// How a step is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Position and momentum by forward Euler with ds = |p| h, theory (2.11): first order, gains energy. For comparison:
    /// a Luneburg lens of 129³ nodes misses its focus by 3.3e-3 R (median) at half a voxel, leapfrog by 4.4e-4.
    ExplicitEuler,
    /// Kick, then drift, theory (2.10), with kicks of (h before + h after)/2: second order, symplectic, reversible, one
    /// force per step.
    #[default]
    Leapfrog,
    /// Classical Runge–Kutta of fourth order, theory (2.12); segments are chords. The reference; has no adjoint. The same
    /// lens: 4.4e-4, which is the error of the grid.
    RungeKutta4,
}

/// Options of a [`Tracer`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<T> {
    /// How a step is made.
    pub integrator: Integrator,
    /// Longest step [voxel of the index grid], in (0, 1]. A transition needs 3 to 4 steps; 0.5 is enough for a blur of one
    /// voxel.
    pub step: T,
    /// Start of visibility from the camera [scene unit]. Clips the first segment only.
    pub near: T,
    /// A path of this many segments ends where it is.
    pub max_segments: usize,
    /// What surfaces mirror.
    pub weight: Weight,
}

impl<T: Real> Default for Options<T> {
    fn default() -> Self {
        Self {
            integrator: Integrator::default(),
            step: T::of(0.5),
            near: T::zero(),
            max_segments: 4096,
            weight: Weight::Whole,
        }
    }
}

/// Traces rays through a medium, inside the domain of a radiance field.
#[derive(Clone, Copy, Debug)]
pub struct Tracer<'a, T: Copy> {
    medium: &'a Medium<T>,
    domain: &'a Domain<T>,
    options: Options<T>,
}

/// What happened at the start of a segment, and how long it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step<T> {
    /// Weight k of the force at the start of the segment, in t; 0 for none.
    pub kick: T,
    /// Length h in t to the next point, or τ to the surface, theory (2.24).
    pub drift: T,
    /// Steps of the lattice that this is: 1, more for a hop in a flat part of a region, 0 for a hop outside.
    pub lattice: u16,
    /// Region of the kick and of the event; without meaning for other hops outside.
    pub region: u16,
    /// What happens at the end of the segment, if that lies on a surface.
    pub event: Option<Event<T>>,
}

/// Why a path ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PathEnd {
    /// It left all regions for good.
    #[default]
    Escaped,
    /// It had [`Options::max_segments`] segments, 65 535 steps in one region, or found no way out of a body that
    /// rounding put it into. What follows is missing.
    Exhausted,
}

/// A bent ray.
#[derive(Clone, Debug, PartialEq)]
pub struct Path<T> {
    /// What the ray passes, from the camera on. A range is empty, at its end,
    /// where the segment lies outside the radiance domain.
    pub segments: Vec<Segment<T>>,
    /// One per segment.
    pub steps: Vec<Step<T>>,
    /// The ray at its end, in vacuum: the end of the last segment and the unit direction there.
    pub exit: Ray<T>,
    /// Why it ended.
    pub end: PathEnd,
}

impl<T> Path<T> {
    /// What happened on surfaces, from the camera on.
    pub fn events(&self) -> impl Iterator<Item = &Event<T>> {
        self.steps.iter().filter_map(|s| s.event.as_ref())
    }
}

impl<T: Real> Default for Path<T> {
    fn default() -> Self {
        let exit = Ray { origin: Vec3::zero(), direction: Vec3::zero() };
        Self { segments: Vec::new(), steps: Vec::new(), exit, end: PathEnd::Escaped }
    }
}

/// dLoss/dray: of the camera ray, or of the exit ray. The direction is a free vector; project it on the tangent plane
/// where directions stay on the sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayAdjoint<T> {
    /// dLoss/dorigin.
    pub origin: Vec3<T>,
    /// dLoss/ddirection.
    pub direction: Vec3<T>,
}

impl<'a, T: Real> Tracer<'a, T> {
    /// A tracer of rays through `medium` that are seen inside `domain`.
    ///
    /// # Panics
    /// If the step is not in (0, 1], if there are more than 65 535 regions, or if one of them has a level set and the
    /// integrator is not leapfrog.
    pub fn new(medium: &'a Medium<T>, domain: &'a Domain<T>, options: Options<T>) -> Self {
        assert!(
            options.step > T::zero() && options.step <= T::one(),
            "a step is a fraction of a voxel, (0, 1], got {:?}",
            options.step
        );
        assert!(medium.regions().len() <= usize::from(u16::MAX), "at most 65 535 refractive regions");
        assert!(
            options.integrator == Integrator::Leapfrog
                || medium.regions().iter().all(|r| r.level_set().is_none()),
            "sharp interfaces need leapfrog"
        );
        Self { medium, domain, options }
    }

    /// Step length in t in a region, theory (2.9): h = `step` · voxel / (largest n), so that ds = n h ≤ `step` voxels.
    pub fn step_length(&self, region: usize) -> T {
        let grid = &self.medium.regions()[region];
        self.options.step * grid.voxel() / grid.largest_index()
    }
}
