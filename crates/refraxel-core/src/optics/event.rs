//! A ray at a sharp surface: the event, theory (2.25), and its transpose, theory (2.27)–(2.29).

use super::mirror::{Arrival, MirrorAdjoint};
use super::step::State;
use super::{PartialReflectionAdjoint, Step, Tracer};
use crate::index::VACUUM;
use crate::segment::Segment;
use crate::{IndexGradient, IndexGrid, LevelSet, Real, Vec3};

/// Least sine of the angle between ray and surface in derivatives, on either side [1]. The transpose divides by the sines
/// of grazing incidence and exit, where the derivatives of an image diverge; smaller sines count as this one.
pub const GRAZING: f64 = 0.05;

/// Bound on the Newton steps of [`Tracer::replay`](Tracer::replay) towards a shifted crossing.
const MOST_STEPS: usize = 30;

/// What happens where a segment ends on the surface of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<T> {
    /// Whether the ray passes.
    pub kind: EventKind,
    /// True if the ray comes from inside the body.
    pub from_inside: bool,
    /// The time u [in t] up to which the kicks of the lattice reach, theory (2.26): the end kick lasts from u to τ. `None`
    /// where the field is flat and needs no end kick. Held fixed in derivatives.
    pub kicked_until: Option<T>,
}

/// Whether a ray passes a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// It passes, by Snell's law.
    Refraction,
    /// It is turned back: total reflection.
    Reflection,
}

/// A ray on a surface, after the end kick and before the event.
pub(super) struct Impact<T> {
    /// The point x_c on the surface [scene unit].
    pub x: Vec3<T>,
    /// Momentum [1].
    pub p: Vec3<T>,
    /// w of the body there [1].
    pub w: T,
    /// ∇w of the body there [1 / scene unit].
    force: Vec3<T>,
    /// ∇φ there [1]; it points out of the body.
    gradient: Vec3<T>,
}

/// How an event turns a ray: p' = p + (s − a) m, theory (2.25).
#[derive(Clone, Copy)]
pub(super) struct Turn<T> {
    /// Unit normal m = ∇φ/|∇φ|.
    normal: Vec3<T>,
    /// a = p · m.
    before: T,
    /// s = p' · m.
    after: T,
}

/// dLoss/d(what a [`Turn`] depends on), theory (2.27).
struct TurnAdjoint<T> {
    /// dLoss/dp, of the momentum after the end kick.
    p: Vec3<T>,
    /// dLoss/dm.
    normal: Vec3<T>,
    /// dLoss/dw of the body.
    w: T,
}

impl<T: Real> Impact<T> {
    /// Position and momentum after the event.
    pub(super) fn after(&self, turn: &Turn<T>) -> State<T> {
        State { x: self.x, p: self.p + turn.normal * (turn.after - turn.before) }
    }

    /// Unit normal m = ∇φ/|∇φ| and normal momentum a = p · m.
    fn normal_momentum(&self) -> (Vec3<T>, T) {
        let normal = self.gradient.normalized();
        (normal, self.p.dot(normal))
    }

    /// The same ray as Fresnel's formulas need it.
    pub(super) fn arrival(&self, event: &Event<T>, turn: &Turn<T>) -> Arrival<T> {
        let Turn { normal, before, after } = *turn;
        Arrival { p: self.p, normal, before, after, w: self.w, from_inside: event.from_inside }
    }
}

impl<T: Real> Event<T> {
    /// +1 if the ray meets the surface along ∇φ, −1 if against it. D = w_new − w_old is −(w − 1/2) times this.
    fn outward(&self) -> T {
        if self.from_inside { T::one() } else { -T::one() }
    }

    /// Length τ − u of the end kick after a drift of length `tau`, theory (2.26).
    fn end_kick(&self, tau: T) -> Option<T> {
        self.kicked_until.map(|until| tau - until)
    }

    /// a² + 2D of theory (2.25), for the normal momentum `before` = a: the ray passes if it is positive.
    fn square_after(&self, before: T, w: T) -> T {
        before * before - (T::of(2.0) * w - T::of(2.0 * VACUUM)) * self.outward()
    }

    /// Decides the kind of the event, theory (2.25). Where rounding at grazing incidence gives a the sign of the other
    /// side, a reflected ray still returns to the side that it came from.
    pub(super) fn choose(&mut self, at: &Impact<T>) -> Turn<T> {
        let (normal, before) = at.normal_momentum();
        let square = self.square_after(before, at.w);
        let passes = square > T::zero();
        self.kind = if passes { EventKind::Refraction } else { EventKind::Reflection };
        let size = if passes { square.sqrt() } else { -before.abs() };
        Turn { normal, before, after: size * self.outward() }
    }

    /// The turn of an event whose kind is known. Not a number if a refraction cannot take place.
    pub(super) fn turn(&self, at: &Impact<T>) -> Turn<T> {
        let (normal, before) = at.normal_momentum();
        let after = match self.kind {
            EventKind::Refraction => self.square_after(before, at.w).sqrt() * self.outward(),
            EventKind::Reflection => -before,
        };
        Turn { normal, before, after }
    }

    /// Transpose of p' = p + (s − a) m with a = p · m and s = s(a, D), theory (2.27), given dLoss/dp', and of its
    /// partial reflection, theory (7.4). s counts as at least [`GRAZING`] |p'|.
    fn turn_vjp(
        &self,
        turn: &Turn<T>,
        p: Vec3<T>,
        mirror: Option<&MirrorAdjoint<T>>,
        d_after: Vec3<T>,
    ) -> TurnAdjoint<T> {
        let (m, change) = (turn.normal, turn.after - turn.before);
        let c = d_after.dot(m);
        // forward: p' = p + (s − a) m
        let (mut d_a, mut d_s) = (-c, c);
        let mut d = TurnAdjoint { p: d_after, normal: d_after * change, w: T::zero() };
        if let Some(mirror) = mirror {
            d_a += mirror.before;
            d_s += mirror.after;
            d.w += mirror.w;
            d.p += mirror.p;
            d.normal += mirror.normal;
        }
        // forward: s² = a² + 2D for refraction, s = −a for reflection
        let d_a = match self.kind {
            EventKind::Refraction => {
                let s = at_least(turn.after, self.outward(), (p + m * change).length());
                d.w -= self.outward() * d_s / s;
                d_a + d_s * turn.before / s
            }
            EventKind::Reflection => d_a - d_s,
        };
        // forward: a = p · m
        d.p += m * d_a;
        d.normal += p * d_a;
        d
    }
}

impl<T: Real> Tracer<'_, T> {
    /// Drift from `start` to the surface and the end kick there, theory (2.26).
    pub(super) fn impact(&self, step: &Step<T>, event: &Event<T>, start: &State<T>) -> Impact<T> {
        let (grid, level) = self.body(step.region);
        let x = start.x + start.p * step.drift;
        let (w, force) = grid.sample(x);
        let p = event.end_kick(step.drift).map_or(start.p, |late| start.p + force * late);
        Impact { x, p, w, force, gradient: level.sample(x).1 }
    }

    /// The crossing near t = `guess` on another line or of another surface, theory (2.24), by Newton's method. Not a number
    /// if there is none.
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

    /// Transpose of a drift that ends with an event, theory (2.27)–(2.29), up to the start of the drift: `d` is
    /// dLoss/d(x, p) after the event and becomes that before the drift. `d_mirror` belongs to its partial reflection. The
    /// coefficients of w and φ receive their shares through `grad`.
    ///
    /// The length τ of the drift is differentiated; sines below [`GRAZING`] are not followed.
    pub(super) fn event_vjp(
        &self,
        step: &Step<T>,
        segment: &Segment<T>,
        d_mirror: Option<&PartialReflectionAdjoint<T>>,
        d: &mut State<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        let Some(event) = &step.event else { return };
        let (region, (grid, level)) = (usize::from(step.region), self.body(step.region));
        let (tau, p1) = (step.drift, segment.momentum);
        let at = self.impact(step, event, &State { x: segment.start, p: p1 });
        let turn = event.turn(&at);
        let mirror = d_mirror.map(|d| at.arrival(event, &turn).vjp(d, self.options.weight));

        // forward: p3 = p2 + (s − a) m with a = p2 · m, s = s(a, D), m = ∇φ/|∇φ|
        let d_turn = event.turn_vjp(&turn, at.p, mirror.as_ref(), d.p);
        d.p = d_turn.p;
        if let Some(mirror) = &mirror {
            d.x += mirror.x;
        }
        let m = turn.normal;
        let d_gradient = (d_turn.normal - m * m.dot(d_turn.normal)) / at.gradient.length();
        d.x += level.hessian(at.x, d_gradient) + grid.w_gradient(at.x) * d_turn.w;
        let mut d_tau = d.x.dot(p1);
        let mut d_force = Vec3::zero();
        if let Some(late) = event.end_kick(tau) {
            // forward: p2 = p1 + (τ − u) ∇w(xc)
            d_force = d.p * late;
            let by_force = grid.gradient_pullback(at.x, d_force);
            d.x += by_force;
            d_tau += by_force.dot(p1) + d.p.dot(at.force);
        }
        if d_turn.w != T::zero() || event.kicked_until.is_some() {
            grad.add(region, grid, at.x, d_turn.w, d_force);
        }
        // forward: xc = x0 + τ p1 with φ(xc) = 0
        let slope = at_least(at.gradient.dot(p1), event.outward(), at.gradient.length() * p1.length());
        let d_phi = -d_tau / slope;
        d.x += at.gradient * d_phi;
        d.p += d.x * tau;
        grad.add_level_set(region, level, at.x, d_phi, d_gradient);
    }

    /// The field of a body and its surface.
    fn body(&self, region: u16) -> (&IndexGrid<T>, &LevelSet<T>) {
        let grid = &self.medium.regions()[usize::from(region)];
        (grid, grid.level_set().expect("events happen at level sets"))
    }
}

/// `v`, whose sign is `sign`, but not smaller than [`GRAZING`] times `size`.
fn at_least<T: Real>(v: T, sign: T, size: T) -> T {
    let least = T::of(GRAZING) * size;
    if v.abs() < least { least * sign } else { v }
}
