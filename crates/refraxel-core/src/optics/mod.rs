//! Bent rays: the ray equation d/ds(n dx/ds) = ∇n, theory (2.1), integrated through a [`Medium`](crate::Medium), and its
//! exact adjoint.
//!
//! With the optical momentum p = n dx/ds and the parameter dt = ds/n the equation reads dx/dt = p, dp/dt = ∇w with
//! w = n²/2, theory (2.2), and |p|² = 2w stays true along a ray, theory (2.3). A [`Path`] is a list of straight
//! [`Segment`](crate::segment::Segment)s: a *kick* changes p at a point, a *drift* of length h in t leads to the next point.
//!
//! Where the field is flat there is no force. Inside a region such points are skipped on the same lattice of steps, many
//! in one segment: the result is the same as marching through each of them. Outside all regions, and through the flat rim
//! of their boxes, one segment leads to the next cell that is not flat, or to the end of the scene.
//!
//! ```
//! use refraxel_core::optics::Options;
//! use refraxel_core::{Aabb, Domain, Extent, IndexGrid, Interpolation, Medium, Ray, Tracer, Vec3, vec3};
//! // A ball of glass, n = 1.5, of radius 20 voxels with a soft edge; a ray at impact b = 10.
//! let cube = Aabb::cube(28.0);
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
//! let cube = Aabb::cube(28.0);
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
mod options;
mod partial_reflections;
mod path;
mod path_adjoint;
mod sides;
mod step;
mod trace;
mod tracer;
pub mod transition;

#[cfg(test)]
mod tests;

pub use crossing::{MOST_STEPS as CROSSING_STEPS, SPACING as CROSSING_SPACING};
pub use event::GRAZING;
pub use mirror::{PartialReflection, PartialReflectionAdjoint};
pub use options::{Integrator, Options};
pub use path::{Event, EventKind, MAX_LATTICE, Path, PathEnd, STRAIGHT, Step};
pub use path_adjoint::{PathAdjoint, RayAdjoint};
pub use tracer::Tracer;
