//! How well a shape separates what straight rays explain from what they do not.

use super::evidence::Evidence;
use crate::model::Gate;
use rayon::prelude::*;

/// How well a hull separates what straight rays explain from what they do not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Separation {
    /// Share of the variance of the residuals that the hull explains, 0 to 1: p (1 − p) (r₁ − r₀)² / variance, with the share p
    /// and the mean residual r₁ of the cells that it covers, and the mean r₀ of the others. (Otsu's criterion.)
    pub share: f64,
    /// p.
    pub covered: f64,
}

/// Number, sum and sum of squares of the residuals of cells beside what a gate covers, and of cells that it covers: of those that
/// show something, for what is empty is explained by anything.
pub(super) fn moments(views: &[&Evidence], gate: &Gate) -> [[f64; 3]; 2] {
    let of = |view: &&Evidence| {
        let mut sums = [[0.0_f64; 3]; 2];
        for (cell, residual) in view.residual.iter().enumerate().filter(|(cell, _)| view.counts(*cell)) {
            let covered = view.rays[cell].is_some_and(|ray| gate.admits(&ray));
            if covered || view.shows_something(cell) {
                let r = f64::from(*residual);
                (0..3).for_each(|k| sums[usize::from(covered)][k] += r.powi(k as i32));
            }
        }
        sums
    };
    let add =
        |a: [[f64; 3]; 2], b: [[f64; 3]; 2]| [0, 1].map(|s| [0, 1, 2].map(|k: usize| a[s][k] + b[s][k]));
    let per_view: Vec<[[f64; 3]; 2]> = views.par_iter().map(of).collect();
    per_view.into_iter().fold([[0.0; 3]; 2], add)
}

/// The separation by a gate.
pub(super) fn separation(views: &[&Evidence], gate: &Gate) -> Separation {
    let [out, inside] = moments(views, gate);
    let all: [f64; 3] = [0, 1, 2].map(|k| out[k] + inside[k]);
    if out[0] == 0.0 || inside[0] == 0.0 {
        return Separation::default();
    }
    let covered = inside[0] / all[0];
    let variance = all[2] / all[0] - (all[1] / all[0]).powi(2);
    let (within, beside) = (inside[1] / inside[0], out[1] / out[0]);
    // Where less is unexplained inside than outside, nothing is found.
    let step = (within - beside).max(0.0);
    let share = if variance > 0.0 { covered * (1.0 - covered) * step * step / variance } else { 0.0 };
    Separation { share, covered }
}
