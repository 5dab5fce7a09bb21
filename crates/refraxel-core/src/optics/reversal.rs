//! The adjoint without a stored path, theory (2.19): leapfrog runs backwards exactly, so the path is made again from its
//! end.
//!
//! Smooth media only. Steps in a region have one length and are counted; whether a point of the lattice had a kick follows from its cell,
//! seen from either side. Hops outside have lengths that only the way in could measure: they are kept, one number each.

use super::step::{State, drift_vjp, exit_vjp};
use super::{Integrator, Path, PathEnd, RayAdjoint, Step, Tracer};
use crate::radiance::{Segment, SegmentAdjoint};
use crate::{IndexGradient, IndexGrid, Ray, Real, Vec3};

/// What is kept of a path between forward and backward: 32 bytes and 8 per visit to a region in `f32`, so at most 64 for
/// up to four visits, besides the camera ray.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept<T> {
    /// Start of the last segment: not its end, which may be far away and known with less precision.
    pub position: Vec3<T>,
    /// Momentum of the last segment.
    pub momentum: Vec3<T>,
    /// Length of the last hop in t; 0 if the path did not escape.
    pub last_hop: T,
    /// Why it ended.
    pub end: PathEnd,
    /// From the camera on.
    pub visits: Vec<Visit<T>>,
}

/// A stay in one region.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visit<T> {
    /// Length in t of the hop that led there.
    pub hop: T,
    /// Steps of the lattice in the region.
    pub lattice: u16,
    /// The region.
    pub region: u16,
}

impl<T: Real> Path<T> {
    /// What [`Tracer::vjp_by_reversal`] needs.
    ///
    /// # Panics
    /// If the path has events: it is kept as it is for [`Tracer::vjp`].
    pub fn kept(&self) -> Kept<T> {
        assert!(self.events().next().is_none(), "paths with sharp interfaces are not reversed");
        let mut visits: Vec<Visit<T>> = Vec::new();
        for step in &self.steps {
            match visits.last_mut().filter(|_| step.lattice > 0) {
                Some(visit) => {
                    visit.lattice += step.lattice;
                    visit.region = step.region;
                }
                None => visits.push(Visit { hop: step.drift, lattice: 0, region: 0 }),
            }
        }
        let escaped = self.end == PathEnd::Escaped;
        let last_hop = if escaped { visits.pop().map_or(T::zero(), |v| v.hop) } else { T::zero() };
        let (position, momentum) = match self.segments.last() {
            Some(s) if escaped => (s.start, s.momentum),
            _ => {
                let last = self.segments.last().map_or(Vec3::zero(), |s| s.momentum);
                (self.exit.origin, last)
            }
        };
        Kept { position, momentum, last_hop, end: self.end, visits }
    }
}

impl<T: Real> Tracer<'_, T> {
    /// [`Self::vjp`] in constant memory. `d_segment` is asked for dLoss/d(start, momentum) of each segment once, from the
    /// last to the first: a renderer runs its own adjoint, back to front, inside it.
    ///
    /// # Panics
    /// Unless the integrator is leapfrog, the one that reverses.
    pub fn vjp_by_reversal(
        &self,
        ray: &Ray<T>,
        kept: &Kept<T>,
        d_exit: &RayAdjoint<T>,
        mut d_segment: impl FnMut(&Segment<T>) -> SegmentAdjoint<T>,
        grad: &mut impl IndexGradient<T>,
    ) -> RayAdjoint<T> {
        assert!(self.options.integrator == Integrator::Leapfrog, "only leapfrog reverses");
        let mut state = State { x: kept.position, p: kept.momentum };
        let mut d = exit_vjp(state.p, d_exit);
        if kept.end == PathEnd::Escaped {
            let range = self.visible(&state, Some(kept.last_hop), kept.visits.is_empty());
            let segment = Segment { start: state.x, momentum: state.p, range };
            drift_vjp(kept.last_hop, d_segment(&segment), &mut d);
        }
        for (k, visit) in kept.visits.iter().enumerate().rev() {
            self.visit_vjp(visit, (&mut state, &mut d), &mut d_segment, grad);
            state.x -= state.p * visit.hop;
            let range = self.visible(&state, Some(visit.hop), k == 0);
            let segment = Segment { start: state.x, momentum: state.p, range };
            drift_vjp(visit.hop, d_segment(&segment), &mut d);
        }
        self.start_vjp(ray, &d, grad)
    }

    /// One stay in a region, backwards.
    fn visit_vjp(
        &self,
        visit: &Visit<T>,
        (state, d): (&mut State<T>, &mut State<T>),
        d_segment: &mut impl FnMut(&Segment<T>) -> SegmentAdjoint<T>,
        grad: &mut impl IndexGradient<T>,
    ) {
        let region = usize::from(visit.region);
        let (grid, h) = (&self.medium.regions()[region], self.step_length(region));
        let mut remaining = visit.lattice;
        while remaining > 0 {
            let lattice = flat_steps_behind(grid, state, h, remaining);
            let (kick, count) = match lattice {
                0 => (self.options.integrator.kick(h, remaining == 1), 1),
                m => (T::zero(), m),
            };
            let step = Step {
                kick,
                drift: h * T::of(f64::from(count)),
                lattice: count,
                region: visit.region,
                event: None,
            };
            state.x -= state.p * step.drift;
            let segment = Segment { start: state.x, momentum: state.p, range: [T::zero(), step.drift] };
            let force = self.advance_vjp((&step, state.x), d_segment(&segment), d, grad);
            // forward: p1 = p0 + k g(x0)
            state.p -= force * kick;
            remaining -= count;
        }
    }
}

/// How many points of the lattice directly behind lie in flat cells. The first point of a visit never counts.
fn flat_steps_behind<T: Real>(grid: &IndexGrid<T>, state: &State<T>, h: T, remaining: u16) -> u16 {
    let is_flat = |m: u16| grid.is_flat(state.x - state.p * (h * T::of(f64::from(m))));
    (1..remaining).take_while(|&m| is_flat(m)).last().unwrap_or(0)
}
