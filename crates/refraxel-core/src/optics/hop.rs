//! Crossing flat cells without a test of each step, theory (2.13).
//!
//! Each cell knows its *clearance*, the Chebyshev distance in cells to the nearest cell that is not flat. A ray in a cell
//! of clearance c may advance c − 1 cells along its fastest axis before it must test again.

use super::crossing::{Side, first_crossing};
use super::step::State;
use super::tracer::Tracer;
use crate::{IndexGrid, Medium, Ray, Real};

/// Where the lattice of steps x + m h p, m = 0, 1, …, first leaves the flat cells.
pub(super) enum Run {
    /// Step m lies in a cell that must be marched, or is the last one allowed.
    Bent(u32),
    /// Step m lies outside the box.
    Outside(u32),
}

/// Follows the lattice of step length `h` in t through the flat cells of a region, at most `limit` steps. Skips by
/// clearance; the result is the same as testing every step.
pub(super) fn run<T: Real>(grid: &IndexGrid<T>, s: &State<T>, h: T, limit: u32) -> Run {
    let lattice = grid.lattice();
    // Cells per step along the fastest axis.
    let reach = s.p.zip(lattice.scale, |p, n| (p * n).abs()).max_element() * h;
    let mut m = 0;
    loop {
        match lattice.clearance_at(lattice.node(s.x + s.p * (h * T::of(f64::from(m))))) {
            None => return Run::Outside(m),
            Some(0) => return Run::Bent(m),
            // The cells at Chebyshev distance < clearance are flat, too.
            Some(c) => m = m.saturating_add(((f64::from(c) - 1.0) / reach.f64()).floor().max(1.0) as u32),
        }
        if m >= limit {
            return Run::Bent(limit);
        }
    }
}

/// Where a line outside all bodies next meets a region.
pub(super) struct Entry<T> {
    /// Parameter t of the line x + t p [scene unit].
    pub t: T,
    /// Number of the region in the medium.
    pub region: usize,
}

/// The first t ≥ `from` at which the line x + t p, outside all bodies, enters a cell that must be marched or meets the
/// surface of a body. `None` if the line meets neither.
pub(super) fn next_entry<T: Real>(medium: &Medium<T>, s: &State<T>, from: T) -> Option<Entry<T>> {
    let line = Ray { origin: s.x, direction: s.p };
    let mut best: Option<Entry<T>> = None;
    for (region, grid) in medium.regions().iter().enumerate() {
        let Some([a, b]) = grid.domain().bounds.clip(&line) else { continue };
        let range = [a.max(from), best.as_ref().map_or(b, |e| b.min(e.t))];
        let found = match grid.level_set() {
            Some(level) => first_crossing(level, s, range, Side::Outside),
            None => grid.lattice().first_marked(s.x, s.p, range),
        };
        if let Some(t) = found {
            best = Some(Entry { t, region });
        }
    }
    best
}

impl<T: Real> Tracer<'_, T> {
    /// The part of a hop of length `hop` in t (endless if `None`) inside the radiance domain; empty, at its end, if there
    /// is none. The first segment of a path is clipped by the near plane, too.
    pub(super) fn visible(&self, state: &State<T>, hop: Option<T>, is_first: bool) -> [T; 2] {
        let line = Ray { origin: state.x, direction: state.p };
        let near = if is_first { self.options.near / state.p.length() } else { T::zero() };
        match self.domain.clip(&line, near) {
            Some([a, b]) if hop.is_none_or(|h| a < h) => [a, hop.map_or(b, |h| b.min(h))],
            _ => [hop.unwrap_or(T::zero()); 2],
        }
    }
}
