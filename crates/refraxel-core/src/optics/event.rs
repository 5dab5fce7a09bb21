//! What a sharp interface does to a ray, theory (2.25), and its transpose, theory (2.27)–(2.29).

use super::mirror::{Arrival, MirrorAdjoint};
use super::step::State;
use super::{PartialReflectionAdjoint, Step, Tracer};
use crate::index::VACUUM;
use crate::radiance::Segment;
use crate::{IndexGradient, LevelSet, Real, Vec3};

/// Least sine of the angle between ray and surface in derivatives, on either side: the transpose divides by the sines
/// at grazing incidence and exit, where the derivatives of an image diverge. Smaller ones count as this [1].
pub const GRAZING: f64 = 0.05;

/// Newton steps of [`Tracer::replay`](Tracer::replay) towards a shifted crossing.
const MOST_STEPS: usize = 30;

/// What happens where a segment ends on the surface of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<T> {
    /// Whether the ray passes.
    pub kind: EventKind,
    /// True if it comes from inside.
    pub from_inside: bool,
    /// u of the end kick, theory (2.26); none where the field is flat. Held fixed in derivatives.
    pub kicked_until: Option<T>,
}

/// Whether a ray passes a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// It does, by Snell's law.
    Refraction,
    /// It does not: total reflection.
    Reflection,
}

/// Normal momentum before and after, and what it is measured against.
pub(super) struct Turn<T> {
    pub normal: Vec3<T>,
    pub before: T,
    pub after: T,
}

impl<T: Real> Event<T> {
    /// +1 if the ray meets the surface along ∇φ, −1 if against it. D = w_new − w_old is −(w − 1/2) times this.
    fn outward(&self) -> T {
        if self.from_inside { T::one() } else { -T::one() }
    }

    /// Momentum p' = p + (s − a) m, theory (2.25), for a body of `w` at the surface. Chooses the kind if asked to.
    fn turn(&mut self, choose: bool, p: Vec3<T>, w: T, gradient: Vec3<T>) -> Turn<T> {
        let (normal, out) = (gradient.normalized(), self.outward());
        let before = p.dot(normal);
        let square = before * before - (T::of(2.0) * w - T::of(2.0 * VACUUM)) * out;
        if choose {
            let passes = square > T::zero();
            self.kind = if passes { EventKind::Refraction } else { EventKind::Reflection };
        }
        // The signs are those of the side of the ray, also where rounding at grazing incidence gives a the other one.
        let after = match self.kind {
            EventKind::Refraction => square.sqrt() * out,
            EventKind::Reflection if choose => -before.abs() * out,
            EventKind::Reflection => -before,
        };
        Turn { normal, before, after }
    }

    /// Transpose of p3 = p2 + (s − a) m with a = p2 · m and s = s(a, D), theory (2.27), given dLoss/dp3, and of what is
    /// mirrored, theory (7.4): dLoss/dp2, dLoss/dm and dLoss/dw of the body.
    fn turn_vjp(
        &self,
        (turn, p2): (&Turn<T>, Vec3<T>),
        mirror: Option<&MirrorAdjoint<T>>,
        d_p3: Vec3<T>,
    ) -> (Vec3<T>, Vec3<T>, T) {
        let (m, change) = (turn.normal, turn.after - turn.before);
        let c = d_p3.dot(m);
        let (mut d_before, mut d_after, mut d_w) = (-c, c, T::zero());
        let (mut d_p2, mut d_m) = (d_p3, d_p3 * change);
        if let Some(mirror) = mirror {
            d_before += mirror.before;
            d_after += mirror.after;
            d_w += mirror.w;
            d_p2 += mirror.p;
            d_m += mirror.normal;
        }
        let d_a = match self.kind {
            EventKind::Refraction => {
                let s = at_least(turn.after, self.outward(), (p2 + m * change).length());
                d_w -= self.outward() * d_after / s;
                d_before + d_after * turn.before / s
            }
            EventKind::Reflection => d_before - d_after,
        };
        (d_p2 + m * d_a, d_m + p2 * d_a, d_w)
    }
}

impl<T: Real> Tracer<'_, T> {
    /// Drift to the surface, end kick and event; `step` says how far, and receives the event's kind if it shall be chosen.
    pub(super) fn meet(&self, step: &mut Step<T>, choose: bool, state: &mut State<T>) {
        let Some(event) = &mut step.event else { return };
        let (grid, level) = self.body(step.region);
        state.x += state.p * step.drift;
        let (w, force) = grid.sample(state.x);
        if let Some(until) = event.kicked_until {
            state.p += force * (step.drift - until);
        }
        let turn = event.turn(choose, state.p, w, level.sample(state.x).1);
        state.p += turn.normal * (turn.after - turn.before);
    }

    /// The crossing near t = `guess` on another line or of another surface, theory (2.24).
    pub(super) fn crossing_near(&self, region: u16, state: &State<T>, guess: T) -> T {
        let (_, level) = self.body(region);
        let mut t = guess;
        for _ in 0..MOST_STEPS {
            let x = state.x + state.p * t;
            let (phi, gradient) = level.sample(x);
            let by = phi / gradient.dot(state.p);
            t -= by;
            if by.abs() <= T::epsilon() * t.abs() {
                break;
            }
        }
        t
    }

    /// The turn of a known event at `x`, where a ray arrives with momentum `p1`; the momentum after the end kick, w, and
    /// ∇w and ∇φ.
    pub(super) fn turn_at(
        &self,
        (step, event): (&Step<T>, &Event<T>),
        (x, p1): (Vec3<T>, Vec3<T>),
    ) -> (Turn<T>, Vec3<T>, T, [Vec3<T>; 2]) {
        let (grid, level) = self.body(step.region);
        let (w, force) = grid.sample(x);
        let late = event.kicked_until.map_or(T::zero(), |until| step.drift - until);
        let p2 = p1 + force * late;
        let gradient = level.sample(x).1;
        ({ *event }.turn(false, p2, w, gradient), p2, w, [force, gradient])
    }

    /// The transpose of a drift that ends with an event, up to the start of the drift: `d` of the state after becomes
    /// that of (x0, p1) before the drift; what the surface mirrors has the adjoint `d_mirror`. Adds to `grad`.
    pub(super) fn meet_vjp(
        &self,
        (step, segment): (&Step<T>, &Segment<T>),
        d_mirror: Option<&PartialReflectionAdjoint<T>>,
        d: &mut State<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        let Some(event) = &step.event else { return };
        let (region, (grid, level)) = (usize::from(step.region), self.body(step.region));
        let (tau, p1) = (step.drift, segment.momentum);
        let x = segment.start + p1 * tau;
        let (turn, p2, w, [force, gradient]) = self.turn_at((step, event), (x, p1));
        let late = event.kicked_until.map_or(T::zero(), |until| tau - until);
        let mirror = d_mirror.map(|d| {
            let (normal, before, after, from_inside) =
                (turn.normal, turn.before, turn.after, event.from_inside);
            Arrival { p: p2, normal, before, after, w, from_inside }.vjp(d, self.options.weight)
        });

        // forward: p3 = p2 + (s − a) m with a = p2 · m, s = s(a, D), m = ∇φ/|∇φ|
        let (d_p2, d_m, d_w) = event.turn_vjp((&turn, p2), mirror.as_ref(), d.p);
        d.p = d_p2;
        if let Some(mirror) = &mirror {
            d.x += mirror.x;
        }
        let m = turn.normal;
        let d_gradient = (d_m - m * m.dot(d_m)) / gradient.length();
        // forward: p2 = p1 + (τ − until) ∇w(xc)
        let d_force = d.p * late;
        d.x += level.hessian(x, d_gradient) + grid.w_gradient(x) * d_w;
        let mut d_tau = d.x.dot(p1);
        if event.kicked_until.is_some() {
            let (_, by_force) = grid.gradient_pullback(x, d_force);
            d.x += by_force;
            d_tau += by_force.dot(p1) + d.p.dot(force);
        }
        if d_w != T::zero() || event.kicked_until.is_some() {
            grad.add((region, grid), x, (d_w, d_force));
        }
        // forward: xc = x0 + τ p1 with φ(xc) = 0
        let sine = at_least(gradient.dot(p1), event.outward(), gradient.length() * p1.length());
        let d_phi = -d_tau / sine;
        d.x += gradient * d_phi;
        d.p += d.x * tau;
        grad.add_level_set((region, level), x, (d_phi, d_gradient));
    }

    fn body(&self, region: u16) -> (&crate::IndexGrid<T>, &LevelSet<T>) {
        let grid = &self.medium.regions()[usize::from(region)];
        (grid, grid.level_set().expect("events happen at level sets"))
    }
}

/// `v`, whose sign is `sign`, but not smaller than [`GRAZING`] times `size`.
fn at_least<T: Real>(v: T, sign: T, size: T) -> T {
    let least = T::of(GRAZING) * size;
    if v.abs() < least { least * sign } else { v }
}
