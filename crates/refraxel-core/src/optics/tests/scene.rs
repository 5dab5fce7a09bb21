//! The scene of most tests: one cubic region inside one domain.

use crate::optics::{Integrator, Options};
use crate::{Aabb, Domain, Extent, IndexGrid, Interpolation, Medium, Vec3};

/// A radiance domain around everything the tests trace through.
pub(super) fn domain() -> Domain<f64> {
    Domain::with_longest(Aabb::cube(3.0), Extent::Bounded, 16)
}

/// One cubic region with n(x) sampled on `nodes`³.
pub(super) fn medium(
    half: f64,
    nodes: u32,
    interpolation: Interpolation,
    n: impl Fn(Vec3<f64>) -> f64,
) -> Medium<f64> {
    Medium::new(vec![IndexGrid::from_samples(Aabb::cube(half), [nodes; 3], interpolation, n)]).unwrap()
}

pub(super) fn options(integrator: Integrator, step: f64) -> Options<f64> {
    Options { integrator, step, ..Options::default() }
}

/// A smooth step from 1 to 0 over about ±2 `width` around 0.
pub(super) fn ramp(x: f64, width: f64) -> f64 {
    0.5 * (1.0 - (x / width).tanh())
}
