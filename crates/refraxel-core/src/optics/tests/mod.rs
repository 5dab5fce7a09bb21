//! Proofs on paths: closed forms of optics, gradients against central differences, and derivatives against Snell's law.

mod absorbing;
mod glass_ball;
mod graded_bodies;
mod gradients;
mod lenses;
mod mirrors;
mod nested;
mod nested_gradients;
mod paths;
mod predictions;
mod sharp;
mod sharp_gradients;
mod snell;

use super::{Integrator, Options, Path, PathAdjoint, RayAdjoint, Tracer};
use crate::index::MediumGradient;
use crate::index::tests::Sequence;
use crate::segment::SegmentAdjoint;
use crate::{Aabb, Domain, Extent, IndexGrid, Interpolation, Medium, Ray, Real, Vec3, vec3};

/// The cube [−half, half]³.
fn cube(half: f64) -> Aabb<f64> {
    Aabb::new(Vec3::splat(-half), Vec3::splat(half))
}

/// A radiance domain around everything the tests trace through.
fn domain() -> Domain<f64> {
    Domain::with_longest(cube(3.0), Extent::Bounded, 16)
}

/// One cubic region with n(x) sampled on `nodes`³.
fn medium(half: f64, nodes: u32, interpolation: Interpolation, n: impl Fn(Vec3<f64>) -> f64) -> Medium<f64> {
    Medium::new(vec![IndexGrid::from_samples(cube(half), [nodes; 3], interpolation, n)]).unwrap()
}

fn options(integrator: Integrator, step: f64) -> Options<f64> {
    Options { integrator, step, ..Options::default() }
}

/// dLoss/d(camera ray) of a loss of the exit ray alone; adds to `grad`.
fn exit_vjp<T: Real>(
    tracer: &Tracer<T>,
    ray: &Ray<T>,
    path: &Path<T>,
    exit: RayAdjoint<T>,
    grad: &mut MediumGradient<T>,
) -> RayAdjoint<T> {
    let segments = vec![SegmentAdjoint::default(); path.segments.len()];
    tracer.vjp(ray, path, &PathAdjoint { segments: &segments, reflections: &[], exit }, grad)
}

/// A smooth step from 1 to 0 over about ±2 `width` around 0.
fn ramp(x: f64, width: f64) -> f64 {
    0.5 * (1.0 - (x / width).tanh())
}

/// Momentum at the start of segment i, where leapfrog knows it only half a kick earlier and later.
fn momentum_at_start(medium: &Medium<f64>, path: &Path<f64>, i: usize) -> Vec3<f64> {
    let (step, s) = (path.steps[i], &path.segments[i]);
    let grid = &medium.regions()[usize::from(step.within.unwrap())];
    // The first kick of a visit is a half one, and complete at the start.
    let is_first = i == 0 || path.steps[i - 1].lattice == 0;
    let late = if is_first { 0.0 } else { 0.5 * step.kick };
    s.momentum - grid.gradient(s.start) * late
}

/// Median and largest of the absolute values.
fn median_and_largest(mut v: Vec<f64>) -> [f64; 2] {
    v.iter_mut().for_each(|v| *v = v.abs());
    v.sort_by(f64::total_cmp);
    [v[v.len() / 2], v[v.len() - 1]]
}
