//! A first hull becomes the places that most views would rather take for refractive.
//!
//! Each cell of each view says by how much it would rather lie inside of the silhouette: s = log(r / τ), between −1 and 1, with its
//! residual r and τ = κ √(r₁ r₀), of the mean residuals of the cells that the first hull covers and of those beside. A place is
//! inside where the mean of s over the views that see it is above a bound: a vote in which nobody has to decide. Which bound
//! gives the shape that separates best depends on how well straight rays explain what is seen through the thing.

use super::Hints;
use super::evidence::Evidence;
use super::hull::{Carved, keep_parts};
use super::separation::moments;
use crate::blur::gaussian_blur;
use crate::cancel::Cancel;
use crate::model::Gate;
use crate::model::polyhedron::Plane;
use rayon::prelude::*;
use refraxel_core::{Domain, Extent, Vec3};

/// κ. Less takes more for refractive.
const KAPPA: f64 = 0.8;
/// Standard deviation of the blur of the votes [voxel].
const BLUR: f32 = 0.6;
/// Share of the views that must see a place.
const SEEN: f32 = 0.3;
/// How fast the share of a voxel that is inside rises with the mean vote.
const SLOPE: f32 = 2.0;

/// How a shape is refined.
#[derive(Clone, Copy)]
pub(super) struct Refining {
    /// Nodes along its longest edge.
    pub nodes: u32,
    /// What it stands on.
    pub ground: Option<Plane>,
}

/// The mean votes of all views.
pub(super) struct Votes {
    domain: Domain<f32>,
    votes: Vec<f32>,
}

impl Votes {
    /// Votes about and around the first hull; without meaning once somebody wishes to stop.
    pub(super) fn new(
        first: &Carved,
        views: &[Evidence],
        how: Refining,
        hints: &Hints,
        cancel: &Cancel,
    ) -> Self {
        let domain = Domain::with_longest(first.bounds, Extent::Bounded, how.nodes);
        let n = domain.resolution.map(|n| n as usize);
        let threshold = threshold(&first.gate, views);
        let vote = |j: usize| {
            let x = domain.place(j);
            let may_be =
                how.ground.is_none_or(|p| p.height(x) > 0.0) && hints.allow(x) && !cancel.is_cancelled();
            if may_be { mean_vote(views, x, threshold) } else { -1.0 }
        };
        let mut votes: Vec<f32> = (0..n[0] * n[1] * n[2]).into_par_iter().map(vote).collect();
        gaussian_blur(&mut votes, domain.resolution, BLUR);
        Self { domain, votes }
    }

    /// What has at least this vote.
    pub(super) fn shape(&self, bound: f32, hints: &Hints) -> Gate {
        let share = self.votes.iter().map(|v| (0.5 + SLOPE * (v - bound)).clamp(0.0, 1.0));
        let mut share: Vec<f32> = share.collect();
        keep_parts(&mut share, &self.domain, hints);
        Gate::new(self.domain, &share)
    }
}

/// τ.
fn threshold(first: &Gate, views: &[Evidence]) -> f32 {
    let mean = |[count, sum, _]: [f64; 3]| (sum / count.max(1.0)).max(1e-4);
    let [beside, within] = moments(&views.iter().collect::<Vec<_>>(), first).map(mean);
    (KAPPA * (beside * within).sqrt()) as f32
}

/// The mean vote about a point; −1 where too few views have it in their picture.
fn mean_vote(views: &[Evidence], x: Vec3<f32>, threshold: f32) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    for view in views {
        let Some(cell) = view.cell_of(x).filter(|cell| view.counts(*cell)) else { continue };
        sum += (view.residual[cell].max(1e-6) / threshold).ln().clamp(-1.0, 1.0);
        count += 1;
    }
    let is_shown = count > 0 && count as f32 >= SEEN * views.len() as f32;
    if is_shown { sum / count as f32 } else { -1.0 }
}
