//! From the camera to the exit: the loop over hops, steps and events.
//!
//! A ray is in one of three states. *Outside* all regions it hops to the next cell that is not flat, or to the surface of
//! the next body. In a *smooth region* it is marched until it leaves the region. In a *body*, the one that rules where
//! several contain it, it is marched, or moves straight, until the next event. Total reflection leaves it in the body;
//! refraction takes it outside or into another body.

use super::crossing::Side;
use super::hop::{Entry, Run, next_entry, run};
use super::path::{MAX_LATTICE, Path, PathEnd, Step};
use super::step::State;
use super::tracer::Tracer;
use crate::index::FLAT;
use crate::segment::Segment;
use crate::{Ray, Real, Vec3};

impl<T: Real> Tracer<'_, T> {
    /// The path of a camera ray.
    pub fn trace(&self, ray: &Ray<T>) -> Path<T> {
        let mut path = Path::default();
        self.trace_into(ray, &mut path);
        path
    }

    /// [`Self::trace`] into memory that is used again: replaces the content of `path`.
    pub fn trace_into(&self, ray: &Ray<T>, path: &mut Path<T>) {
        path.segments.clear();
        path.steps.clear();
        let mut state = self.start(ray);
        // Where the search for the next region begins, in t from the state.
        let mut from = T::zero();
        let mut inside = self.medium.ruling_at(ray.origin).filter(|&r| self.is_body(r));
        path.end = loop {
            if let Some(region) = inside {
                if !self.cross_body(region, &mut state, path) {
                    break PathEnd::Exhausted;
                }
                (inside, from) = (leads_into(path), T::zero());
                continue;
            }
            let Some(Entry { t, region }) = next_entry(self.medium, &state, from) else {
                let [_, end] = self.visible(&state, None, path.segments.is_empty());
                self.hop(end, &mut state, path);
                break PathEnd::Escaped;
            };
            if self.is_body(region) {
                if path.steps.len() >= self.options.max_segments {
                    break PathEnd::Exhausted;
                }
                let step = Step { drift: t, region: region as u16, ..Step::default() };
                self.end_on_surface(step, Side::Outside, None, &mut state, path);
                (inside, from) = (leads_into(path), T::zero());
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
    /// ranges, whatever lies there now, and the same events, at the crossings nearby, theory (2.24).
    ///
    /// This is the function whose derivative [`Self::vjp`] transposes. Not a number where an event of `path` does not take
    /// place.
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
    fn start(&self, ray: &Ray<T>) -> State<T> {
        State { x: ray.origin, p: ray.direction * self.medium.index(ray.origin) }
    }

    /// Advances `state` by one step and returns the momentum of its segment. The drift of a step that ends with an event
    /// becomes the τ of the crossing nearby.
    #[inline]
    fn advance(&self, step: &mut Step<T>, state: &mut State<T>) -> Vec3<T> {
        if let Some(event) = step.event {
            self.kick(step, state);
            let momentum = state.p;
            step.drift = self.crossing_near(step.region, state, step.drift);
            let at = self.impact(step, &event, state);
            *state = at.after(&event.turn(&at));
            return momentum;
        }
        let Some(region) = step.within.filter(|_| step.kick != T::zero()) else {
            state.x += state.p * step.drift;
            return state.p;
        };
        self.options.integrator.step(&self.medium.regions()[usize::from(region)], step, state)
    }

    /// Appends a hop of length `t` outside, or through the flat rim of regions, and moves `state` to its end.
    fn hop(&self, t: T, state: &mut State<T>, path: &mut Path<T>) {
        let is_first = path.segments.is_empty();
        let range = self.visible(state, Some(t), is_first);
        // A camera may stand where a region without level set is flat, but not vacuum.
        let is_vacuum = |r: &usize| (self.medium.regions()[*r].index(state.x) - T::one()).abs() < T::of(FLAT);
        let around = if is_first { self.medium.ruling_at(state.x).filter(|r| !is_vacuum(r)) } else { None };
        let within = around.map(|region| region as u16);
        path.segments.push(Segment { start: state.x, momentum: state.p, range });
        path.steps.push(Step { drift: t, within, region: within.unwrap_or(0), ..Step::default() });
        state.x += state.p * t;
    }

    /// Marches through one region from its first cell that is not flat. Returns where the ray has left the region, in t
    /// from the state; `None` when there are too many steps.
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
                within: Some(region as u16),
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

/// The body that rules at the end of a path so far.
fn leads_into<T: Real>(path: &Path<T>) -> Option<usize> {
    path.steps.last().and_then(Step::leads_into).map(usize::from)
}
