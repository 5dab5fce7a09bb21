//! Bent rays: the ray equation d/ds(n dx/ds) = ∇n, theory (2.1), integrated through a [`Medium`], and its exact adjoint.
//!
//! With the optical momentum p = n dx/ds and the parameter dt = ds/n the equation reads dx/dt = p, dp/dt = ∇w with
//! w = n²/2, theory (2.2), and |p|² = 2w stays true along a ray, theory (2.3). A [`Path`] is a list of straight
//! [`Segment`]s: a *kick* changes p at a point, a *drift* of length h in t leads to the next point.
//!
//! Where the field is flat there is no force. Inside a region such points are skipped on the same lattice of steps, many
//! in one segment: the result is the same as marching through each of them. Outside all regions, and through the flat rim
//! of their boxes, one segment leads to the next cell that is not flat, or to the end of the scene.
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
//! segment there and turns p by Snell's law. The same ball with a sharp edge is exact to 1e-4 degrees:
//!
//! ```
//! use refraxel_core::optics::{Options, PathAdjoint, RayAdjoint};
//! use refraxel_core::segment::SegmentAdjoint;
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
//! // The loss is exit.direction.y; there is no radiance along the segments.
//! let segments = vec![SegmentAdjoint::default(); path.segments.len()];
//! let exit = RayAdjoint { origin: Vec3::zero(), direction: vec3(0.0, 1.0, 0.0) };
//! tracer.vjp(&ray, &path, &PathAdjoint { segments: &segments, reflections: &[], exit }, &mut gradient);
//! // By the index: cos(0.3675) × −2 b/(n²R √(1 − (b/nR)²)) = −0.4399.
//! let by_index: f64 = 1.5 * gradient.index[0].iter().sum::<f64>();
//! assert!((by_index + 0.4399).abs() < 1e-3, "{by_index}");
//! // One step of gradient descent on the surface.
//! let body = medium.region_mut(0).level_set_mut().unwrap();
//! for (c, d) in body.coefficients_mut().iter_mut().zip(&gradient.level_set[0]) {
//!     *c -= 0.1 * d;
//! }
//! body.smooth(0.03);
//! body.redistance();
//! # Ok::<(), refraxel_core::index::Overlap>(())
//! ```
//!
//! **What derivatives hold fixed.** The lengths h of steps and hops, their number, the clipping of segments by the
//! radiance domain, and where the camera is: in which region, behind which near plane. All of these belong to the
//! discretisation, as t and dt do for quadrature. The crossing of a surface is differentiated: its t moves with the ray and
//! with the surface, and so does everything after it; only the end of the segment's own range stays, theory (2.30).
//!
//! [`Tracer::vjp`] is the exact transpose of the derivative of [`Tracer::replay`]. Letting hops end on the faces of cells
//! instead would add terms in proportion to the kick there, and ∇w vanishes at the end of a flat cell: it only shifts the
//! lattice, on which the exit ray depends by O(h²). Against central differences of [`Tracer::trace`], which chooses its
//! steps again, derivatives of the exit direction by the origin are off by 1.5e-2, 3.6e-3 and 9e-4 (median) at steps of
//! 0.5, 0.25 and 0.125 voxel (ball on 49³ nodes, edge of 1 voxel, cubic B-spline).
//!
//! Bodies may overlap: the last one in the list that contains a point rules there, theory (2.23), and an event takes place
//! only where the ruling body changes. A ray remembers the body that rules. Surfaces of bodies below are not looked for, and
//! which of them rules next is decided where that body ends, so that a path cannot lose count.
//!
//! What is transported is the basic radiance L/n², which is invariant along a ray: no factor appears where n changes.

mod adjoint;
mod body;
mod crossing;
mod event;
pub mod fresnel;
mod hop;
mod mirror;
mod partial_reflections;
mod sides;
mod step;
mod trace;
pub mod transition;

#[cfg(test)]
mod tests;

pub use crossing::{MOST_STEPS as CROSSING_STEPS, SPACING as CROSSING_SPACING};
pub use event::{Event, EventKind, GRAZING};
pub use mirror::{PartialReflection, PartialReflectionAdjoint};

use crate::segment::{Segment, SegmentAdjoint};
use crate::{Domain, Medium, Ray, Real, Vec3};

/// Most lattice steps of one visit to a region: what [`Step::lattice`] can count.
pub const MAX_LATTICE: u32 = u16::MAX as u32;

/// Cosine of the angle between the directions of a ray before and after a path up to which the path is straight [1]: 4.5 mrad; single
/// precision rounds to less.
pub const STRAIGHT: f64 = 1.0 - 1e-5;

/// The rule that advances position and momentum by one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Forward Euler for position and momentum with ds = |p| h, theory (2.11). First order; gains energy. For comparison:
    /// a Luneburg lens on 129³ nodes misses its focus by 3.3e-3 R (median) at half a voxel, leapfrog by 4.4e-4 R.
    ExplicitEuler,
    /// A kick, then a drift, theory (2.10), with kicks of (h before + h after)/2. Second order, symplectic, reversible; one
    /// force per step.
    #[default]
    Leapfrog,
    /// Classical fourth-order Runge–Kutta, theory (2.12); its segments are chords. The reference; has no adjoint. On the
    /// same lens it misses by 4.4e-4 R, the error of the grid.
    RungeKutta4,
}

/// Options of a [`Tracer`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<T> {
    /// The rule of a step.
    pub integrator: Integrator,
    /// Longest step [voxel of the index grid], in (0, 1]. A transition needs 3 to 4 steps: 0.5 is enough for an edge
    /// blurred by one voxel.
    pub step: T,
    /// Arc length from the camera at which the field becomes visible [scene unit]. Clips the first segment only.
    pub near: T,
    /// Bound on the segments of a path; a path that reaches it ends there as [`PathEnd::Exhausted`].
    pub max_segments: usize,
}

impl<T: Real> Default for Options<T> {
    fn default() -> Self {
        Self { integrator: Integrator::default(), step: T::of(0.5), near: T::zero(), max_segments: 4096 }
    }
}

/// Traces rays through a medium, inside the domain of a radiance field.
#[derive(Clone, Copy, Debug)]
pub struct Tracer<'a, T: Copy> {
    medium: &'a Medium<T>,
    domain: &'a Domain<T>,
    options: Options<T>,
}

/// How one segment of a path came about: the kick at its start, its length, and the event at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step<T> {
    /// Weight k of the force at the start of the segment, in t; 0 for none.
    pub kick: T,
    /// Length h in t to the next point, or τ to the surface, theory (2.24).
    pub drift: T,
    /// Steps of the lattice in this segment: 1, more for a hop in a flat part of a region, 0 for a hop outside.
    pub lattice: u16,
    /// The body on whose surface the event takes place; otherwise the region `within`.
    pub region: u16,
    /// The region that rules along the segment and whose field kicks; `None` in vacuum.
    pub within: Option<u16>,
    /// The event at the end of the segment, if that lies on a surface.
    pub event: Option<Event<T>>,
}

impl<T: Real> Step<T> {
    /// The region that rules after the step and its event; `None` in vacuum.
    pub fn leads_into(&self) -> Option<u16> {
        self.event.map_or(self.within, |event| event.next(self.within))
    }
}

/// Why a path ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PathEnd {
    /// It left all regions for good.
    #[default]
    Escaped,
    /// It had [`Options::max_segments`] segments, 65 535 steps in one region, or found no way out of a body that
    /// rounding put it into. The rest of the path is missing.
    Exhausted,
}

/// A bent ray.
#[derive(Clone, Debug, PartialEq)]
pub struct Path<T> {
    /// The straight pieces, from the camera on.
    pub segments: Vec<Segment<T>>,
    /// How each segment came about; one per segment.
    pub steps: Vec<Step<T>>,
    /// The ray at its end, in vacuum: the end of the last segment and the unit direction there.
    pub exit: Ray<T>,
    /// Why it ended.
    pub end: PathEnd,
}

impl<T> Path<T> {
    /// The events on surfaces, from the camera on.
    pub fn events(&self) -> impl Iterator<Item = &Event<T>> {
        self.steps.iter().filter_map(|s| s.event.as_ref())
    }
}

impl<T: Real> Path<T> {
    /// Whether it is other than the straight `ray`: it meets a surface, or leaves in another direction.
    pub fn bends(&self, ray: &Ray<T>) -> bool {
        self.events().next().is_some() || ray.direction.dot(self.exit.direction) < T::of(STRAIGHT)
    }
}

impl<T: Real> Default for Path<T> {
    fn default() -> Self {
        let exit = Ray { origin: Vec3::zero(), direction: Vec3::zero() };
        Self { segments: Vec::new(), steps: Vec::new(), exit, end: PathEnd::Escaped }
    }
}

/// dLoss/d(ray), of the camera ray or of the exit ray. The direction is a free vector; project it on the tangent plane
/// where directions stay on the unit sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayAdjoint<T> {
    /// dLoss/dorigin [1 / scene unit].
    pub origin: Vec3<T>,
    /// dLoss/ddirection [1].
    pub direction: Vec3<T>,
}

/// dLoss/d(path): the input of [`Tracer::vjp`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathAdjoint<'a, T> {
    /// dLoss/d(segment), one per segment, as [`render_vjp`](crate::radiance::render_vjp) returns them.
    pub segments: &'a [SegmentAdjoint<T>],
    /// dLoss/d(partial reflection) in the order of [`Tracer::partial_reflections`], one for each or for the first of them.
    pub reflections: &'a [PartialReflectionAdjoint<T>],
    /// dLoss/d(exit ray).
    pub exit: RayAdjoint<T>,
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

    /// Step length in t [scene unit] in a region, theory (2.9): h = `step` · voxel / (largest n), so that ds = n h is at
    /// most `step` voxels.
    pub fn step_length(&self, region: usize) -> T {
        let grid = &self.medium.regions()[region];
        self.options.step * grid.voxel() / grid.largest_index()
    }
}
