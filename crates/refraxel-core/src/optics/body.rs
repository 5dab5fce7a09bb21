//! Inside a body, from one event to the next, theory (2.24) and (2.26).
//!
//! A body of one index needs one segment: the ray is straight until it meets the surface. In a body with a field of its
//! own the ray is marched on a lattice of steps that begins at the event with half a kick. Before each drift the surface is
//! looked for on the line ahead; where it cuts the drift short, the event's end kick completes the kicks so far. The
//! surfaces of bodies that cut into this one and rule there, theory (2.23), are looked for as well.

use super::crossing::{Side, first_crossing};
use super::hop::{Run, run};
use super::path::{Event, EventKind, MAX_LATTICE, Path, Step};
use super::step::State;
use super::tracer::Tracer;
use crate::segment::Segment;
use crate::{Ray, Real};

/// Where a ray inside a body meets a surface.
struct Boundary<T> {
    /// t from the state [scene unit].
    t: T,
    /// The body that the surface belongs to.
    body: usize,
    /// The side of that body on which the ray is.
    side: Side,
}

impl<T: Real> Tracer<'_, T> {
    /// True for a region with a sharp surface.
    pub(super) fn is_body(&self, region: usize) -> bool {
        self.medium.regions()[region].level_set().is_some()
    }

    /// The kick of a step, p ← p + k ∇w(x); a kick of 0 evaluates no force.
    pub(super) fn kick(&self, step: &Step<T>, state: &mut State<T>) {
        if let Some(region) = step.within.filter(|_| step.kick != T::zero()) {
            let grid = &self.medium.regions()[usize::from(region)];
            state.p += grid.gradient(state.x) * step.kick;
        }
    }

    /// Appends the last drift before the surface of body `step.region` to `path` and lets its event act on `state`. `side`
    /// is the side of this body that the ray comes from, `kicked_until` the u of theory (2.26).
    pub(super) fn end_on_surface(
        &self,
        mut step: Step<T>,
        side: Side,
        kicked_until: Option<T>,
        state: &mut State<T>,
        path: &mut Path<T>,
    ) {
        path.segments.push(self.visible_segment(&step, state, path));
        let (x, from_inside) = (state.x + state.p * step.drift, side == Side::Inside);
        let beyond = self.medium.ruling_behind(usize::from(step.region), !from_inside, x, state.p);
        let kind = EventKind::Refraction; // until chosen
        let beyond = beyond.map(|region| region as u16);
        let mut event = Event { kind, from_inside, beyond, kicked_until };
        let impact = self.impact(&step, &event, state);
        let turn = event.choose(&impact);
        *state = impact.after(&turn);
        step.event = Some(event);
        path.steps.push(step);
    }

    /// The segment of a drift, with the range of it that lies inside the radiance field.
    fn visible_segment(&self, step: &Step<T>, state: &State<T>, path: &Path<T>) -> Segment<T> {
        let range = self.visible(state, Some(step.drift), path.segments.is_empty());
        Segment { start: state.x, momentum: state.p, range }
    }

    /// Marches inside a body until another body or vacuum rules, or until a total reflection. False when there are too many
    /// steps, or no surface.
    pub(super) fn cross_body(&self, region: usize, state: &mut State<T>, path: &mut Path<T>) -> bool {
        let (grid, h) = (&self.medium.regions()[region], self.step_length(region));
        let mut lattice: u32 = 0;
        while path.steps.len() < self.options.max_segments && lattice < MAX_LATTICE {
            let Some(mut step) = self.step_inside(region, state, lattice) else { return false };
            self.kick(&step, state);
            if let Some(Boundary { t, body, side }) = self.first_boundary(region, state, step.drift) {
                // Kicks so far reach to the middle of the interval of the lattice that the surface cuts short.
                let interval = (t / h).floor().min(T::of(f64::from(step.lattice) - 1.0));
                let is_flat = grid.is_uniform() || grid.is_flat(state.x + state.p * t);
                let kicked_until = (!is_flat).then(|| (interval + T::of(0.5)) * h);
                (step.drift, step.region) = (t, body as u16);
                self.end_on_surface(step, side, kicked_until, state, path);
                return true;
            }
            if grid.is_uniform() {
                return false;
            }
            lattice += u32::from(step.lattice);
            path.segments.push(self.visible_segment(&step, state, path));
            state.x += state.p * step.drift;
            path.steps.push(step);
        }
        false
    }

    /// Where a ray that `region` rules first leaves it or meets a body that rules over it, before t = `end`.
    fn first_boundary(&self, region: usize, state: &State<T>, end: T) -> Option<Boundary<T>> {
        let regions = self.medium.regions();
        let own = first_crossing(regions[region].level_set()?, state, [T::zero(), end], Side::Inside);
        let mut first = own.map(|t| Boundary { t, body: region, side: Side::Inside });
        for body in self.medium.rulers_over(region) {
            let (line, bounds) = (Ray { origin: state.x, direction: state.p }, regions[body].domain().bounds);
            let (Some([a, b]), Some(level)) = (bounds.clip(&line), regions[body].level_set()) else {
                continue;
            };
            let range = [a.max(T::zero()), b.min(first.as_ref().map_or(end, |f| f.t))];
            if let Some(t) = first_crossing(level, state, range, Side::Outside) {
                first = Some(Boundary { t, body, side: Side::Outside });
            }
        }
        first
    }

    /// The step that follows if no surface comes in its way: to the face of the box through a body of one index, otherwise
    /// on the lattice that began at the last event and has made `lattice` steps. `None` at the faces of the box.
    fn step_inside(&self, region: usize, state: &State<T>, lattice: u32) -> Option<Step<T>> {
        let (grid, h) = (&self.medium.regions()[region], self.step_length(region));
        let mut step = Step { region: region as u16, within: Some(region as u16), ..Step::default() };
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
