//! Crossing flat cells without looking at each step, theory (2.13).

use super::step::State;
use crate::{IndexGrid, Medium, Ray, Real};

/// A hop into a cell goes this much deeper [voxel]: far enough for the cell to be recognised after rounding in `f32`.
const NUDGE: f64 = 1.0 / 256.0;

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
    let reach = s.p.zip(grid.nodes_per_world(), |p, n| (p * n).abs()).max_element() * h;
    let mut m = 0;
    loop {
        match grid.clearance_at(grid.node(s.x + s.p * (h * T::of(f64::from(m))))) {
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

/// The first t ≥ `from` at which the line x + t p enters a cell that must be marched, and the region of that cell.
pub(super) fn next_entry<T: Real>(medium: &Medium<T>, s: &State<T>, from: T) -> Option<(T, usize)> {
    let line = Ray { origin: s.x, direction: s.p };
    let mut best: Option<(T, usize)> = None;
    for (region, grid) in medium.regions().iter().enumerate() {
        let Some([a, b]) = grid.domain().bounds.clip(&line) else { continue };
        let end = best.map_or(b, |(t, _)| b.min(t));
        if let Some(t) = first_bent(grid, s, a.max(from), end) {
            best = Some((t, region));
        }
    }
    best
}

/// The first t in [t, end) at which the line lies in a cell that must be marched.
fn first_bent<T: Real>(grid: &IndexGrid<T>, s: &State<T>, mut t: T, end: T) -> Option<T> {
    let velocity = s.p.hadamard(grid.nodes_per_world());
    let nudge = T::of(NUDGE) / velocity.map(T::abs).max_element();
    let last = grid.domain().resolution.map(|n| T::of(f64::from(n - 1)));
    while t < end {
        let mut g = grid.node(s.x + s.p * t);
        for a in 0..3 {
            g[a] = g[a].max(T::zero()).min(last[a]);
        }
        let clearance = grid.clearance_at(g)?;
        if clearance == 0 {
            return Some(t);
        }
        // The block of cells at distance < clearance is flat: leave it.
        let block = T::of(f64::from(clearance));
        let mut leave = T::infinity();
        for a in 0..3 {
            let (v, cell) = (velocity[a], g[a].floor());
            if v > T::zero() {
                leave = leave.min((cell + block - g[a]) / v);
            } else if v < T::zero() {
                leave = leave.min((cell + T::one() - block - g[a]) / v);
            }
        }
        t += leave + nudge;
    }
    None
}
