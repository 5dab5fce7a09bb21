//! Inside a body, from one event to the next, theory (2.24) and (2.26).
//!
//! A body of one index needs one segment: the ray is straight until it meets the surface. In a body with a field of its
//! own the ray is marched on a lattice of steps that begins at the event with half a kick. Before each drift the surface is
//! looked for on the line ahead; where it cuts the drift short, the event's end kick completes the kicks so far.

use super::crossing::{Side, first_crossing};
use super::hop::{Run, run};
use super::step::State;
use super::{Event, EventKind, MAX_LATTICE, Path, Step, Tracer};
use crate::segment::Segment;
use crate::{Ray, Real};

impl<T: Real> Tracer<'_, T> {
    /// True for a region with a sharp surface.
    pub(super) fn is_body(&self, region: usize) -> bool {
        self.medium.regions()[region].level_set().is_some()
    }

    /// The kick of a step, p ← p + k ∇w(x); a kick of 0 evaluates no force.
    pub(super) fn kick(&self, step: &Step<T>, state: &mut State<T>) {
        if step.kick != T::zero() {
            let grid = &self.medium.regions()[usize::from(step.region)];
            state.p += grid.gradient(state.x) * step.kick;
        }
    }

    /// Appends the last drift before a surface to `path` and lets its event act on `state`. `side` is the side that the
    /// ray comes from, `kicked_until` the u of theory (2.26). Returns what the event turned out to be.
    pub(super) fn end_on_surface(
        &self,
        mut step: Step<T>,
        side: Side,
        kicked_until: Option<T>,
        state: &mut State<T>,
        path: &mut Path<T>,
    ) -> EventKind {
        path.segments.push(self.visible_segment(&step, state, path));
        let kind = EventKind::Refraction; // until chosen
        let mut event = Event { kind, from_inside: side == Side::Inside, kicked_until };
        let impact = self.impact(&step, &event, state);
        let turn = event.choose(&impact);
        *state = impact.after(&turn);
        step.event = Some(event);
        path.steps.push(step);
        event.kind
    }

    /// The segment of a drift, with the range of it that lies inside the radiance field.
    fn visible_segment(&self, step: &Step<T>, state: &State<T>, path: &Path<T>) -> Segment<T> {
        let range = self.visible(state, Some(step.drift), path.segments.is_empty());
        Segment { start: state.x, momentum: state.p, range }
    }

    /// Marches inside a body to its surface. `None` when there are too many steps, or no surface.
    pub(super) fn cross_body(
        &self,
        region: usize,
        state: &mut State<T>,
        path: &mut Path<T>,
    ) -> Option<EventKind> {
        let grid = &self.medium.regions()[region];
        let (level, h) = (grid.level_set()?, self.step_length(region));
        let mut lattice: u32 = 0;
        while path.steps.len() < self.options.max_segments && lattice < MAX_LATTICE {
            let mut step = self.step_inside(region, state, lattice)?;
            self.kick(&step, state);
            if let Some(t) = first_crossing(level, state, [T::zero(), step.drift], Side::Inside) {
                // Kicks so far reach to the middle of the interval of the lattice that the surface cuts short.
                let interval = (t / h).floor().min(T::of(f64::from(step.lattice) - 1.0));
                let is_flat = grid.is_uniform() || grid.is_flat(state.x + state.p * t);
                let kicked_until = (!is_flat).then(|| (interval + T::of(0.5)) * h);
                step.drift = t;
                return Some(self.end_on_surface(step, Side::Inside, kicked_until, state, path));
            }
            if grid.is_uniform() {
                return None;
            }
            lattice += u32::from(step.lattice);
            path.segments.push(self.visible_segment(&step, state, path));
            state.x += state.p * step.drift;
            path.steps.push(step);
        }
        None
    }

    /// The step that follows if no surface comes in its way: to the face of the box through a body of one index, otherwise
    /// on the lattice that began at the last event and has made `lattice` steps. `None` at the faces of the box.
    fn step_inside(&self, region: usize, state: &State<T>, lattice: u32) -> Option<Step<T>> {
        let (grid, h) = (&self.medium.regions()[region], self.step_length(region));
        let mut step = Step { region: region as u16, ..Step::default() };
        if grid.is_uniform() {
            let line = Ray { origin: state.x, direction: state.p };
            step.drift = grid.domain().bounds.clip(&line)?[1];
            return Some(step);
        }
        let mut count = 1;
        if grid.is_flat(state.x) {
            let (Run::Outside(m) | Run::Bent(m)) = run(grid, state, h, MAX_LATTICE - lattice);
            count = m;
        } else {
            step.kick = self.options.integrator.kick(h, lattice == 0);
        }
        step.lattice = count as u16;
        step.drift = h * T::of(f64::from(count));
        (count > 0).then_some(step)
    }
}
