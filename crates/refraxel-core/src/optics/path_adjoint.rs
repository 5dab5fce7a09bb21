//! Derivatives of a loss by the rays at both ends of a path, and by the path itself.

use super::mirror::PartialReflectionAdjoint;
use crate::Vec3;
use crate::segment::SegmentAdjoint;

/// dLoss/d(ray), of the camera ray or of the exit ray. The direction is a free vector; project it on the tangent plane
/// where directions stay on the unit sphere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RayAdjoint<T> {
    /// dLoss/dorigin [1 / scene unit].
    pub origin: Vec3<T>,
    /// dLoss/ddirection [1].
    pub direction: Vec3<T>,
}

/// dLoss/d(path): the input of [`Tracer::vjp`](super::Tracer::vjp).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathAdjoint<'a, T> {
    /// dLoss/d(segment), one per segment, as [`render_vjp`](crate::radiance::render_vjp) returns them.
    pub segments: &'a [SegmentAdjoint<T>],
    /// dLoss/d(partial reflection) in the order of [`Tracer::partial_reflections`](super::Tracer::partial_reflections), one
    /// for each or for the first of them.
    pub reflections: &'a [PartialReflectionAdjoint<T>],
    /// dLoss/d(exit ray).
    pub exit: RayAdjoint<T>,
}
