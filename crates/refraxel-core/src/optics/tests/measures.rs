//! What tests measure of paths: derivatives of the exit ray, momenta, and the size of errors.

use crate::index::MediumGradient;
use crate::optics::{Path, PathAdjoint, RayAdjoint, Tracer};
use crate::segment::SegmentAdjoint;
use crate::{Medium, Ray, Real, Vec3};

/// dLoss/d(camera ray) of a loss of the exit ray alone; adds to `grad`.
pub(super) fn exit_vjp<T: Real>(
    tracer: &Tracer<T>,
    ray: &Ray<T>,
    path: &Path<T>,
    exit: RayAdjoint<T>,
    grad: &mut MediumGradient<T>,
) -> RayAdjoint<T> {
    let segments = vec![SegmentAdjoint::default(); path.segments.len()];
    tracer.vjp(ray, path, &PathAdjoint { segments: &segments, reflections: &[], exit }, grad)
}

/// Momentum at the start of segment i, where leapfrog knows it only half a kick earlier and later.
pub(super) fn momentum_at_start(medium: &Medium<f64>, path: &Path<f64>, i: usize) -> Vec3<f64> {
    let (step, s) = (path.steps[i], &path.segments[i]);
    let grid = &medium.regions()[usize::from(step.within.unwrap())];
    // The first kick of a visit is a half one, and complete at the start.
    let is_first = i == 0 || path.steps[i - 1].lattice == 0;
    let late = if is_first { 0.0 } else { 0.5 * step.kick };
    s.momentum - grid.gradient(s.start) * late
}

/// Median and largest of the absolute values.
pub(super) fn median_and_largest(mut v: Vec<f64>) -> [f64; 2] {
    v.iter_mut().for_each(|v| *v = v.abs());
    v.sort_by(f64::total_cmp);
    [v[v.len() / 2], v[v.len() - 1]]
}
