//! Options of tracing: the integrator, and how far and how finely it goes.

use crate::Real;

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

/// Options of a [`Tracer`](super::Tracer).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options<T> {
    /// The rule of a step.
    pub integrator: Integrator,
    /// Longest step [voxel of the index grid], in (0, 1]. A transition needs 3 to 4 steps: 0.5 is enough for an edge
    /// blurred by one voxel.
    pub step: T,
    /// Arc length from the camera at which the field becomes visible [scene unit]. Clips the first segment only.
    pub near: T,
    /// Bound on the segments of a path; a path that reaches it ends there as
    /// [`PathEnd::Exhausted`](super::PathEnd::Exhausted).
    pub max_segments: usize,
}

impl<T: Real> Default for Options<T> {
    fn default() -> Self {
        Self { integrator: Integrator::default(), step: T::of(0.5), near: T::zero(), max_segments: 4096 }
    }
}
