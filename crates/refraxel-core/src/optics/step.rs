//! One step of each integrator, and its transpose.

use super::options::Integrator;
use super::path::Step;
use super::path_adjoint::RayAdjoint;
use crate::segment::SegmentAdjoint;
use crate::{IndexGradient, IndexGrid, Real, Vec3};

/// The phase-space point (x, p) of a ray between two steps: position [scene unit] and momentum [1]. Also dLoss/d(x, p).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State<T> {
    pub x: Vec3<T>,
    pub p: Vec3<T>,
}

/// A step with a kick, as its transpose needs it.
pub(super) struct KickedStep<'a, T: Copy> {
    /// The region whose field kicks, and its number in the medium.
    pub grid: &'a IndexGrid<T>,
    /// See `grid`.
    pub region: usize,
    /// Where the step began, and where the force acts [scene unit].
    pub x: Vec3<T>,
    /// Weight k of the force, in t.
    pub kick: T,
    /// Length h of the drift, in t.
    pub drift: T,
}

impl Integrator {
    /// Weight k of the kick for a step of length h: h, and h/2 for the first point of a visit, which comes after a hop
    /// without force, theory (2.10).
    pub(super) fn kick<T: Real>(self, h: T, is_first: bool) -> T {
        if self == Self::Leapfrog && is_first { T::of(0.5) * h } else { h }
    }

    /// One step, theory (2.10)–(2.12): moves `state` on and returns the momentum of the segment between the two points.
    #[inline]
    pub(super) fn step<T: Real>(self, grid: &IndexGrid<T>, step: &Step<T>, state: &mut State<T>) -> Vec3<T> {
        let (k, h) = (step.kick, step.drift);
        if k == T::zero() {
            state.x += state.p * h;
            return state.p;
        }
        match self {
            Self::Leapfrog => {
                // theory (2.10)
                state.p += grid.gradient(state.x) * k;
                state.x += state.p * h;
                state.p
            }
            Self::ExplicitEuler => {
                // theory (2.11)
                let before = state.p;
                state.p += grid.gradient(state.x) * k;
                state.x += before * h;
                before
            }
            Self::RungeKutta4 => {
                let start = state.x;
                *state = runge_kutta(grid, state, h);
                (state.x - start) / h
            }
        }
    }

    /// Transpose of the derivative of [`Self::step`], theory (2.15)–(2.17): `d` is dLoss/d(state) after the step and
    /// becomes that before it; `d_segment` belongs to the segment between and is added on the way. The coefficients of w
    /// receive their share through `grad`. Not differentiable on cell faces, except for the B-spline.
    #[inline]
    pub(super) fn step_vjp<T: Real>(
        self,
        at: &KickedStep<'_, T>,
        d_segment: SegmentAdjoint<T>,
        d: &mut State<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        // forward: p1 = p0 + k ∇w(x0); returns the share of x0
        let mut kick_vjp = |d_p: Vec3<T>| {
            let d_force = d_p * at.kick;
            grad.add(at.region, at.grid, at.x, T::zero(), d_force);
            at.grid.gradient_pullback(at.x, d_force)
        };
        match self {
            Self::Leapfrog => {
                // forward: x1 = x0 + h p1
                d.p += d.x * at.drift + d_segment.momentum;
                let d_x = kick_vjp(d.p);
                d.x += d_segment.start + d_x;
            }
            _ => {
                // forward: x1 = x0 + h p0
                let d_x = kick_vjp(d.p);
                d.p += d.x * at.drift + d_segment.momentum;
                d.x += d_segment.start + d_x;
            }
        }
    }
}

/// Transpose of a drift of length `h` in t without a kick, theory (2.15): `d` of the state after it becomes that before.
#[inline]
pub(super) fn drift_vjp<T: Real>(h: T, d_segment: SegmentAdjoint<T>, d: &mut State<T>) {
    // forward: x1 = x0 + h p
    d.p += d.x * h + d_segment.momentum;
    d.x += d_segment.start;
}

/// One step of the classical Runge–Kutta method, theory (2.12): error O(h⁵) where w is smooth over a step.
fn runge_kutta<T: Real>(grid: &IndexGrid<T>, s: &State<T>, h: T) -> State<T> {
    let (half, two) = (h * T::of(0.5), T::of(2.0));
    let slope = |x: Vec3<T>, p: Vec3<T>| State { x: p, p: grid.gradient(x) };
    let a = slope(s.x, s.p);
    let b = slope(s.x + a.x * half, s.p + a.p * half);
    let c = slope(s.x + b.x * half, s.p + b.p * half);
    let d = slope(s.x + c.x * h, s.p + c.p * h);
    let mean = |a: Vec3<T>, b: Vec3<T>, c: Vec3<T>, d: Vec3<T>| (a + (b + c) * two + d) * (h / T::of(6.0));
    State { x: s.x + mean(a.x, b.x, c.x, d.x), p: s.p + mean(a.p, b.p, c.p, d.p) }
}

/// dLoss/d(state) at the end of a path from dLoss/d(exit ray), theory (2.18): the exit direction is d = p/|p|.
pub(super) fn exit_vjp<T: Real>(momentum: Vec3<T>, d_exit: &RayAdjoint<T>) -> State<T> {
    let n = momentum.length();
    let d = momentum / n;
    State { x: d_exit.origin, p: (d_exit.direction - d * d.dot(d_exit.direction)) / n }
}
