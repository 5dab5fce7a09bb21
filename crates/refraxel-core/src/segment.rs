//! The straight pieces that a path is made of, theory (3.1).

use crate::{Domain, Ray, Real, Vec3};

/// A straight piece of a path, theory (3.1): x(t) = start + t p for t in `range`, with arc length ds = |p| dt.
///
/// In vacuum p is the unit direction and t the arc length; in a medium |p| = n and t is the optical parameter, dt = ds/n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment<T> {
    /// x at t = 0 [scene unit].
    pub start: Vec3<T>,
    /// Optical momentum p = n dx/ds [1].
    pub momentum: Vec3<T>,
    /// Interval of t [scene unit] that lies inside the radiance field. Empty, with both ends at the end of the segment,
    /// where none of it does.
    pub range: [T; 2],
}

impl<T: Real> Segment<T> {
    /// The part of a straight ray inside `domain`, from the arc length `near` [scene unit] on; `None` if the ray misses it.
    pub fn straight(ray: &Ray<T>, domain: &Domain<T>, near: T) -> Option<Self> {
        let range = domain.clip(ray, near)?;
        Some(Self { start: ray.origin, momentum: ray.direction, range })
    }
    /// The point x(t) [scene unit].
    #[inline(always)]
    pub fn at(&self, t: T) -> Vec3<T> {
        self.start + self.momentum * t
    }
}

/// dLoss/d(segment) with its `range`, the part that the radiance field fills, held fixed, theory (3.14).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SegmentAdjoint<T> {
    /// dLoss/dstart [1 / scene unit].
    pub start: Vec3<T>,
    /// dLoss/dmomentum [1].
    pub momentum: Vec3<T>,
    /// dLoss/d(the t at which the segment ends) [1 / scene unit], of what depends on its length, such as absorption, theory
    /// (7.20). Counts where the segment ends on a surface; all other lengths are held fixed.
    pub end: T,
}
