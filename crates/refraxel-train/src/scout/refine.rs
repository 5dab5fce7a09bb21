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
/// A place is hidden where less than this share of the views that have it in their picture see it.
const HIDDEN: f32 = 0.3;
/// How fast the share of a voxel that is inside rises with the mean vote.
const SLOPE: f32 = 2.0;

/// How a shape is refined.
#[derive(Clone, Copy)]
pub(super) struct Refining {
    /// Nodes along its longest edge.
    pub nodes: u32,
    /// What is seen as opaque is, and not haze in the place of glass.
    pub clean: bool,
    /// What it stands on.
    pub ground: Option<Plane>,
}

/// The mean votes of all views.
pub(super) struct Votes {
    domain: Domain<f32>,
    votes: Vec<f32>,
    /// Nodes that few views see, because what they see before them is opaque.
    hidden: Vec<bool>,
    /// Away from what things stand on.
    up: Option<Vec3<f32>>,
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
            let x = domain.position(domain.coordinates(j));
            let may_be =
                how.ground.is_none_or(|p| p.height(x) > 0.0) && hints.allow(x) && !cancel.is_cancelled();
            let margin = how.clean.then_some(domain.voxel());
            if may_be {
                mean_vote(views, x, threshold, margin)
            } else {
                Vote { mean: -1.0, is_hidden: false }
            }
        };
        let all: Vec<Vote> = (0..n[0] * n[1] * n[2]).into_par_iter().map(vote).collect();
        let mut votes: Vec<f32> = all.iter().map(|v| v.mean).collect();
        gaussian_blur(&mut votes, domain.resolution, BLUR);
        let hidden = all.iter().map(|v| v.is_hidden).collect();
        Self { domain, votes, hidden, up: how.ground.map(|p| p.normal()) }
    }

    /// What has at least this vote, down to what it stands on as far as nobody sees whether it ends before: through a tank or a
    /// block straight rays see a ground that is raised, and do not look below.
    pub(super) fn shape(&self, bound: f32, hints: &Hints) -> Gate {
        let share = self.votes.iter().map(|v| (0.5 + SLOPE * (v - bound)).clamp(0.0, 1.0));
        let mut share: Vec<f32> = share.collect();
        if let Some(up) = self.up {
            let below: Vec<usize> =
                (0..share.len()).into_par_iter().filter(|j| self.is_below(&share, *j, up)).collect();
            below.into_iter().for_each(|j| share[j] = 1.0);
        }
        keep_parts(&mut share, &self.domain, hints);
        Gate::new(self.domain, &share)
    }

    /// Whether a hidden node lies below something that is inside, with hidden nodes between.
    fn is_below(&self, share: &[f32], node: usize, up: Vec3<f32>) -> bool {
        let n = self.domain.resolution.map(|n| n as usize);
        let (x, step) = (self.domain.position(self.domain.coordinates(node)), up * self.domain.voxel());
        let above = (1..).map_while(|k| {
            let at = self.domain.node(x + step * k as f32).map(f32::round).to_array();
            let is_in = (0..3).all(|a| at[a] >= 0.0 && at[a] < n[a] as f32);
            is_in.then(|| at[0] as usize + n[0] * (at[1] as usize + n[1] * at[2] as usize))
        });
        self.hidden[node] && { above }
            .find(|j| share[*j] >= 0.5 || !self.hidden[*j])
            .is_some_and(|j| share[j] >= 0.5)
    }
}

/// τ.
fn threshold(first: &Gate, views: &[Evidence]) -> f32 {
    let mean = |[count, sum, _]: [f64; 3]| (sum / count.max(1.0)).max(1e-4);
    let [beside, within] = moments(&views.iter().collect::<Vec<_>>(), first).map(mean);
    (KAPPA * (beside * within).sqrt()) as f32
}

/// What the views say about a point.
struct Vote {
    /// −1 where too few views have it in their picture.
    mean: f32,
    /// Opaque things hide it in most of them.
    is_hidden: bool,
}

/// The vote about a point. Opaque things hide what lies further than `margin` behind them.
fn mean_vote(views: &[Evidence], x: Vec3<f32>, threshold: f32, margin: Option<f32>) -> Vote {
    let (mut sum, mut count, mut sees) = (0.0, 0, 0);
    for view in views {
        let Some(cell) = view.cell_of(x).filter(|cell| view.counts(*cell)) else { continue };
        sees += 1;
        if margin.is_none_or(|m| view.reaches(cell, x, m)) {
            sum += (view.residual[cell].max(1e-6) / threshold).ln().clamp(-1.0, 1.0);
            count += 1;
        }
    }
    let is_shown = sees as f32 >= SEEN * views.len() as f32;
    let mean = if count > 0 && is_shown { sum / count as f32 } else { -1.0 };
    Vote { mean, is_hidden: is_shown && (count as f32) < HIDDEN * sees as f32 }
}
