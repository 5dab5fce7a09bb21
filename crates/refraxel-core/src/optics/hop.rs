//! Crossing flat cells without looking at each step, theory (2.13).

use super::crossing::{Side, first_crossing};
use super::step::State;
use crate::{IndexGrid, Medium, Ray, Real};

/// Where the lattice x + m h p, m = 0, 1, …, first meets something.
pub(super) enum Run {
    /// A cell that must be marched.
    Bent(u32),
    /// The outside of the box.
    Outside(u32),
}

/// Follow the lattice through the flat cells of a region, at most `limit` steps. Steps over cells by their clearance;
/// the result is the same as testing every step.
pub(super) fn run<T: Real>(grid: &IndexGrid<T>, s: &State<T>, h: T, limit: u32) -> Run {
    let lattice = grid.lattice();
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

/// The first t ≥ `from` at which the line x + t p, outside all bodies, enters a cell that must be marched or meets the
/// surface of a body, and the region of it.
pub(super) fn next_entry<T: Real>(medium: &Medium<T>, s: &State<T>, from: T) -> Option<(T, usize)> {
    let line = Ray { origin: s.x, direction: s.p };
    let mut best: Option<(T, usize)> = None;
    for (region, grid) in medium.regions().iter().enumerate() {
        let Some([a, b]) = grid.domain().bounds.clip(&line) else { continue };
        let range = [a.max(from), best.map_or(b, |(t, _)| b.min(t))];
        let found = match grid.level_set() {
            Some(level) => first_crossing(level, s, range, Side::Outside),
            None => grid.lattice().first_marked((s.x, s.p), range[0], range[1]),
        };
        if let Some(t) = found {
            best = Some((t, region));
        }
    }
    best
}
