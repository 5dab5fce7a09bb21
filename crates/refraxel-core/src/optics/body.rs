//! Inside a body, from one event to the next.

use super::crossing::{Side, first_crossing};
use super::hop::{Run, run};
use super::step::State;
use super::trace::MAX_LATTICE;
use super::{Event, EventKind, Path, Step, Tracer};
use crate::radiance::Segment;
use crate::{Ray, Real};

impl<T: Real> Tracer<'_, T> {
    pub(super) fn is_body(&self, region: usize) -> bool {
        self.medium.regions()[region].level_set().is_some()
    }

    pub(super) fn kick(&self, step: &Step<T>, state: &mut State<T>) {
        if step.kick != T::zero() {
            let grid = &self.medium.regions()[usize::from(step.region)];
            state.p += grid.gradient(state.x) * step.kick;
        }
    }

    /// The last drift before a surface, and the event there.
    pub(super) fn end_on_surface(
        &self,
        mut step: Step<T>,
        side: Side,
        kicked_until: Option<T>,
        (state, path): (&mut State<T>, &mut Path<T>),
    ) -> EventKind {
        path.segments.push(self.visible_segment(&step, state, path));
        let kind = EventKind::Refraction; // until chosen
        step.event = Some(Event { kind, from_inside: side == Side::Inside, kicked_until });
        self.meet(&mut step, true, state);
        path.steps.push(step);
        step.event.map_or(kind, |e| e.kind)
    }

    fn visible_segment(&self, step: &Step<T>, state: &State<T>, path: &Path<T>) -> Segment<T> {
        let range = self.visible(state, Some(step.drift), path.segments.is_empty());
        Segment { start: state.x, momentum: state.p, range }
    }

    /// March inside a body to its surface; `None` when there are too many steps, or no surface.
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
                return Some(self.end_on_surface(step, Side::Inside, kicked_until, (state, path)));
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

    /// The next step if no surface came: to the face of the box through a body of one index, otherwise on the lattice that
    /// began at the last event. `None` at the faces of the box.
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
