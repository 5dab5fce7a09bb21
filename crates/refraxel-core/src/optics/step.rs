//! One step of each integrator: forwards, backwards, and transposed.

use super::{Integrator, RayAdjoint, Step};
use crate::radiance::SegmentAdjoint;
use crate::{IndexGradient, IndexGrid, Real, Vec3};

/// Position and momentum between two steps; also their adjoints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State<T> {
    pub x: Vec3<T>,
    pub p: Vec3<T>,
}

impl Integrator {
    /// Weight of the kick for a step of length h. The first point of a visit comes after a hop, which needs no force.
    pub(super) fn kick<T: Real>(self, h: T, first: bool) -> T {
        if self == Self::Leapfrog && first { T::of(0.5) * h } else { h }
    }

    /// One step: moves `state` on and returns the momentum of the segment between.
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

    /// The transpose of the derivative of [`Self::step`] that began at `x`, theory (2.15)–(2.17): `d` of the state after
    /// becomes that of the state before, `d_segment` is added on the way. Adds to `grad`.
    #[inline]
    pub(super) fn step_vjp<T: Real>(
        self,
        (region, grid): (usize, &IndexGrid<T>),
        (step, x): (&Step<T>, Vec3<T>),
        (d_start, d_momentum): SegmentAdjoint<T>,
        d: &mut State<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        let mut kick = |d_force: Vec3<T>| {
            grad.add((region, grid), x, (T::zero(), d_force));
            grid.gradient_pullback(x, d_force).1
        };
        match self {
            Self::Leapfrog => {
                // forward: x1 = x0 + h p1
                d.p += d.x * step.drift + d_momentum;
                // forward: p1 = p0 + k g(x0)
                let d_x = kick(d.p * step.kick);
                d.x += d_start + d_x;
            }
            _ => {
                // forward: p1 = p0 + k g(x0), x1 = x0 + h p0
                let d_x = kick(d.p * step.kick);
                d.p += d.x * step.drift + d_momentum;
                d.x += d_start + d_x;
            }
        }
    }
}

/// The transpose of a drift without a kick, theory (2.15).
#[inline]
pub(super) fn drift_vjp<T: Real>(h: T, (d_start, d_momentum): SegmentAdjoint<T>, d: &mut State<T>) {
    // forward: x1 = x0 + h p
    d.p += d.x * h + d_momentum;
    d.x += d_start;
}

/// One step of the classical Runge–Kutta method, theory (2.12).
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

/// Adjoint of the state at the end, with `momentum`, from that of the exit ray, theory (2.18): d = p/|p|.
pub(super) fn exit_vjp<T: Real>(momentum: Vec3<T>, d_exit: &RayAdjoint<T>) -> State<T> {
    let n = momentum.length();
    let d = momentum / n;
    State { x: d_exit.origin, p: (d_exit.direction - d * d.dot(d_exit.direction)) / n }
}
