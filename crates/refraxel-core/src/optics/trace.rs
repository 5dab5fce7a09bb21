//! From the camera to the exit: the loop over hops and steps.

use super::crossing::Side;
use super::hop::{Run, next_entry, run};
use super::step::State;
use super::{EventKind, Path, PathEnd, Step, Tracer};
use crate::radiance::Segment;
use crate::{Ray, Real, Vec3};

/// Most lattice steps of one visit to a region: what [`Step::lattice`] can count.
pub(super) const MAX_LATTICE: u32 = u16::MAX as u32;

impl<T: Real> Tracer<'_, T> {
    /// Trace a camera ray.
    pub fn trace(&self, ray: &Ray<T>) -> Path<T> {
        let mut path = Path::default();
        self.trace_into(ray, &mut path);
        path
    }

    /// Trace a camera ray into memory that is used again.
    pub fn trace_into(&self, ray: &Ray<T>, path: &mut Path<T>) {
        path.segments.clear();
        path.steps.clear();
        let mut state = self.start(ray);
        let mut from = T::zero();
        let mut inside = self.medium.ruling_at(ray.origin).filter(|&r| self.is_body(r));
        path.end = loop {
            if let Some(region) = inside {
                match self.cross_body(region, &mut state, path) {
                    Some(EventKind::Reflection) => {}
                    Some(EventKind::Refraction) => (inside, from) = (None, T::zero()),
                    None => break PathEnd::Exhausted,
                }
                continue;
            }
            let Some((t, region)) = next_entry(self.medium, &state, from) else {
                let [_, end] = self.visible(&state, None, path.segments.is_empty());
                self.hop(end, &mut state, path);
                break PathEnd::Escaped;
            };
            if self.is_body(region) {
                if path.steps.len() >= self.options.max_segments {
                    break PathEnd::Exhausted;
                }
                let step = Step { drift: t, region: region as u16, ..Step::default() };
                let kind = self.end_on_surface(step, Side::Outside, None, (&mut state, path));
                inside = (kind == EventKind::Refraction).then_some(region);
                from = T::zero();
                continue;
            }
            self.hop(t, &mut state, path);
            match self.visit(region, &mut state, path) {
                Some(t) => from = t,
                None => break PathEnd::Exhausted,
            }
        };
        path.exit = Ray { origin: state.x, direction: state.p.normalized() };
    }

    /// The path of another ray, or in a medium with other coefficients, by the steps of `path`: the same lengths h and
    /// ranges, whatever lies there now, and the same events, at the crossings nearby, theory (2.24). This is the function
    /// whose derivative [`Self::vjp`] transposes. Not a number where an event of `path` does not take place.
    pub fn replay(&self, ray: &Ray<T>, path: &Path<T>) -> Path<T> {
        let mut state = self.start(ray);
        let mut out = path.clone();
        for (step, segment) in out.steps.iter_mut().zip(&mut out.segments) {
            segment.start = state.x;
            segment.momentum = self.advance(step, &mut state);
        }
        out.exit = Ray { origin: state.x, direction: state.p.normalized() };
        out
    }

    /// p = n d at the camera, theory (2.14).
    pub(super) fn start(&self, ray: &Ray<T>) -> State<T> {
        State { x: ray.origin, p: ray.direction * self.medium.index(ray.origin) }
    }

    /// One step; the momentum of its segment.
    #[inline]
    fn advance(&self, step: &mut Step<T>, state: &mut State<T>) -> Vec3<T> {
        if step.event.is_some() {
            self.kick(step, state);
            let momentum = state.p;
            step.drift = self.crossing_near(step.region, state, step.drift);
            self.meet(step, false, state);
            return momentum;
        }
        if step.kick == T::zero() {
            state.x += state.p * step.drift;
            return state.p;
        }
        self.options.integrator.step(&self.medium.regions()[usize::from(step.region)], step, state)
    }

    /// The part of a hop of length `hop` (endless if `None`) inside the radiance domain; empty, at its end, if none.
    pub(super) fn visible(&self, state: &State<T>, hop: Option<T>, is_first: bool) -> [T; 2] {
        let line = Ray { origin: state.x, direction: state.p };
        let near = if is_first { self.options.near / state.p.length() } else { T::zero() };
        match self.domain.clip(&line, near) {
            Some([a, b]) if hop.is_none_or(|h| a < h) => [a, hop.map_or(b, |h| b.min(h))],
            _ => [hop.unwrap_or(T::zero()); 2],
        }
    }

    /// A hop of length `t` outside, or through the flat rim of regions.
    fn hop(&self, t: T, state: &mut State<T>, path: &mut Path<T>) {
        let range = self.visible(state, Some(t), path.segments.is_empty());
        path.segments.push(Segment { start: state.x, momentum: state.p, range });
        path.steps.push(Step { drift: t, ..Step::default() });
        state.x += state.p * t;
    }

    /// March through one region from its first cell that is not flat. Returns where, in t from the state, the ray has
    /// left the region; `None` when it has too many steps.
    fn visit(&self, region: usize, state: &mut State<T>, path: &mut Path<T>) -> Option<T> {
        let (grid, h) = (&self.medium.regions()[region], self.step_length(region));
        let mut lattice: u32 = 0;
        while path.steps.len() < self.options.max_segments && lattice < MAX_LATTICE {
            let is_first = lattice == 0;
            let mut step = Step {
                kick: self.options.integrator.kick(h, is_first),
                drift: h,
                lattice: 1,
                region: region as u16,
                event: None,
            };
            if !is_first && grid.is_flat(state.x) {
                match run(grid, state, h, MAX_LATTICE - lattice) {
                    Run::Outside(m) => return Some(h * T::of(f64::from(m))),
                    Run::Bent(m) => {
                        step.lattice = m as u16;
                        step.kick = T::zero();
                        step.drift = h * T::of(f64::from(m));
                    }
                }
            }
            lattice += u32::from(step.lattice);
            let start = state.x;
            let momentum = self.advance(&mut step, state);
            path.segments.push(Segment { start, momentum, range: [T::zero(), step.drift] });
            path.steps.push(step);
        }
        None
    }
}
