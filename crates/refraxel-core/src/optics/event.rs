//! A ray at a sharp surface: the event, theory (2.25), and its transpose, theory (2.27)–(2.29).

use super::mirror::{Arrival, MirrorAdjoint, PartialReflectionAdjoint};
use super::path::{Event, EventKind, Step};
use super::sides::Sides;
use super::step::State;
use super::tracer::Tracer;
use crate::index::VACUUM;
use crate::segment::Segment;
use crate::{IndexGradient, IndexGrid, LevelSet, Real, Vec3};

/// Least sine of the angle between ray and surface in derivatives, on either side [1]. The transpose divides by the sines
/// of grazing incidence and exit, where the derivatives of an image diverge; smaller sines count as this one.
pub const GRAZING: f64 = 0.05;

/// Bound on the Newton steps of [`Tracer::replay`](Tracer::replay) towards a shifted crossing.
const MOST_STEPS: usize = 30;

/// A ray on a surface, after the end kick and before the event.
pub(super) struct Impact<T> {
    /// The point x_c on the surface [scene unit].
    pub x: Vec3<T>,
    /// Momentum [1].
    pub p: Vec3<T>,
    /// w there, of the region that the ray comes from and of that beyond [1].
    pub w: Sides<T>,
    /// ∇w there of the region that the ray comes from [1 / scene unit].
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

/// dLoss/d(the end of a segment on a surface) beyond what the rest of the path hands back.
#[derive(Clone, Copy)]
pub(super) struct SegmentEndAdjoint<'a, T> {
    /// dLoss/dτ of what depends on the length of the segment.
    pub tau: T,
    /// dLoss/d(partial reflection), where there is one.
    pub mirror: Option<&'a PartialReflectionAdjoint<T>>,
}

/// dLoss/d(what a [`Turn`] depends on), theory (2.27).
struct TurnAdjoint<T> {
    /// dLoss/dp, of the momentum after the end kick.
    p: Vec3<T>,
    /// dLoss/dm.
    normal: Vec3<T>,
    /// dLoss/dw on both sides.
    w: Sides<T>,
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

    /// a² + 2D of theory (2.25), for the normal momentum `before` = a: the ray passes if it is positive.
    fn square_after(&self, before: T) -> T {
        let two = T::of(2.0);
        before * before + (two * self.w.after - two * self.w.before)
    }

    /// The same ray as Fresnel's formulas need it.
    pub(super) fn arrival(&self, turn: &Turn<T>) -> Arrival<T> {
        let Turn { normal, before, after } = *turn;
        Arrival { p: self.p, normal, before, after, w: self.w }
    }
}

impl<T: Real> Event<T> {
    /// +1 if the ray meets the surface along ∇φ, −1 if against it.
    fn outward(&self) -> T {
        if self.from_inside { T::one() } else { -T::one() }
    }

    /// Length τ − u of the end kick after a drift of length `tau`, theory (2.26).
    fn end_kick(&self, tau: T) -> Option<T> {
        self.kicked_until.map(|until| tau - until)
    }

    /// Decides the kind of the event, theory (2.25). Where rounding at grazing incidence gives a the sign of the other
    /// side, a reflected ray still returns to the side that it came from.
    pub(super) fn choose(&mut self, at: &Impact<T>) -> Turn<T> {
        let (normal, before) = at.normal_momentum();
        let square = at.square_after(before);
        let passes = square > T::zero();
        self.kind = if passes { EventKind::Refraction } else { EventKind::Reflection };
        let size = if passes { square.sqrt() } else { -before.abs() };
        Turn { normal, before, after: size * self.outward() }
    }

    /// The turn of an event whose kind is known. Not a number if a refraction cannot take place.
    pub(super) fn turn(&self, at: &Impact<T>) -> Turn<T> {
        let (normal, before) = at.normal_momentum();
        let after = match self.kind {
            EventKind::Refraction => at.square_after(before).sqrt() * self.outward(),
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
        let none = Sides { before: T::zero(), after: T::zero() };
        let mut d = TurnAdjoint { p: d_after, normal: d_after * change, w: none };
        if let Some(mirror) = mirror {
            d_a += mirror.before;
            d_s += mirror.after;
            d.w = mirror.w;
            d.p += mirror.p;
            d.normal += mirror.normal;
        }
        // forward: s² = a² + 2D for refraction, s = −a for reflection
        let d_a = match self.kind {
            EventKind::Refraction => {
                // forward: D = w_after − w_before
                let s = at_least(turn.after, self.outward(), (p + m * change).length());
                d.w.after += d_s / s;
                d.w.before -= d_s / s;
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
        let x = start.x + start.p * step.drift;
        let (before, force) = self.field(step.within, x);
        let (after, _) = self.field(event.beyond, x);
        let p = event.end_kick(step.drift).map_or(start.p, |late| start.p + force * late);
        let gradient = self.surface(step.region).sample(x).1;
        Impact { x, p, w: Sides { before, after }, force, gradient }
    }

    /// (w, ∇w) of a region, or of vacuum.
    fn field(&self, region: Option<u16>, x: Vec3<T>) -> (T, Vec3<T>) {
        self.grid(region).map_or((T::of(VACUUM), Vec3::zero()), |grid| grid.sample(x))
    }

    /// The crossing near t = `guess` on another line or of another surface, theory (2.24), by Newton's method. Not a number
    /// if there is none.
    pub(super) fn crossing_near(&self, region: u16, state: &State<T>, guess: T) -> T {
        let level = self.surface(region);
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
    /// dLoss/d(x, p) after the event and becomes that before the drift. `d_end` is what else depends on the event. The
    /// coefficients of w and φ receive their shares through `grad`.
    ///
    /// The length τ of the drift is differentiated; sines below [`GRAZING`] are not followed.
    pub(super) fn event_vjp(
        &self,
        step: &Step<T>,
        segment: &Segment<T>,
        d_end: SegmentEndAdjoint<'_, T>,
        d: &mut State<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        let Some(event) = &step.event else { return };
        let level = self.surface(step.region);
        let (tau, p1) = (step.drift, segment.momentum);
        let at = self.impact(step, event, &State { x: segment.start, p: p1 });
        let turn = event.turn(&at);
        let mirror = d_end.mirror.map(|d| at.arrival(&turn).vjp(d));

        // forward: p3 = p2 + (s − a) m with a = p2 · m, s = s(a, D), m = ∇φ/|∇φ|
        let d_turn = event.turn_vjp(&turn, at.p, mirror.as_ref(), d.p);
        d.p = d_turn.p;
        if let Some(mirror) = &mirror {
            d.x += mirror.x;
        }
        let m = turn.normal;
        let d_gradient = (d_turn.normal - m * m.dot(d_turn.normal)) / at.gradient.length();
        let by_w = |region, d_w: T| self.grid(region).map_or(Vec3::zero(), |g| g.w_gradient(at.x) * d_w);
        let by_sides = by_w(step.within, d_turn.w.before) + by_w(event.beyond, d_turn.w.after);
        d.x += level.hessian(at.x, d_gradient) + by_sides;
        let mut d_tau = d_end.tau + d.x.dot(p1);
        let mut d_force = Vec3::zero();
        if let Some((late, grid)) = event.end_kick(tau).zip(self.grid(step.within)) {
            // forward: p2 = p1 + (τ − u) ∇w(xc)
            d_force = d.p * late;
            let by_force = grid.gradient_pullback(at.x, d_force);
            d.x += by_force;
            d_tau += by_force.dot(p1) + d.p.dot(at.force);
        }
        for (region, d_w, d_force) in
            [(step.within, d_turn.w.before, d_force), (event.beyond, d_turn.w.after, Vec3::zero())]
        {
            // Vacuum has no coefficients.
            if let (Some(number), Some(grid)) = (region, self.grid(region))
                && (d_w != T::zero() || d_force != Vec3::zero())
            {
                grad.add(usize::from(number), grid, at.x, d_w, d_force);
            }
        }
        // forward: xc = x0 + τ p1 with φ(xc) = 0
        let slope = at_least(at.gradient.dot(p1), event.outward(), at.gradient.length() * p1.length());
        let d_phi = -d_tau / slope;
        d.x += at.gradient * d_phi;
        d.p += d.x * tau;
        grad.add_level_set(usize::from(step.region), level, at.x, d_phi, d_gradient);
    }

    /// The field of a region; `None` for vacuum.
    fn grid(&self, region: Option<u16>) -> Option<&IndexGrid<T>> {
        region.map(|r| &self.medium.regions()[usize::from(r)])
    }
    /// The surface of a body.
    fn surface(&self, region: u16) -> &LevelSet<T> {
        let grid = &self.medium.regions()[usize::from(region)];
        grid.level_set().expect("events happen at level sets")
    }
}

/// `v`, whose sign is `sign`, but not smaller than [`GRAZING`] times `size`.
fn at_least<T: Real>(v: T, sign: T, size: T) -> T {
    let least = T::of(GRAZING) * size;
    if v.abs() < least { least * sign } else { v }
}
