//! Masks that contradict the others: missing ones, and those of another view.
//!
//! A hull that forgives many dissenting views hardly depends on any single one, so it stands for what the *other* views
//! say. Where its projection and a view's mask have little in common, compared with the other views, that mask is wrong
//! altogether. A mask that is a little too small or too large everywhere cannot be told from a smaller or larger thing.

use super::hull::Vote;
use super::locate::Search;
use super::outline::{Outline, Outlines};
use crate::model::Gate;
use rayon::prelude::*;
use refraxel_core::{Aabb, Domain, Extent, Ray};

/// Shares of the views that make the hulls to compare with, from the most forgiving on: once the wrong masks are left
/// out, a stricter hull tells the others apart.
const SHARES: [f32; 3] = [0.75, 0.85, 0.9];
/// Nodes along the longest edge of each hull.
const NODES: u32 = 40;
/// A mask contradicts the others when its overlap is less than the median of all views by this much, and by
const FAR: f32 = 0.15;
/// so many standard deviations, which 1.48 median deviations from the median estimate.
const DEVIATIONS: f32 = 5.0 * 1.4826;
/// Views from which on one can be told from the others.
const LEAST_VIEWS: usize = 6;
/// Where more than this share of the masks contradict the others, nobody knows which are right.
const MOST_WRONG: f32 = 0.34;
/// Median overlap below which the hull means nothing.
const MEANINGLESS: f32 = 0.3;

/// What a hull covers beside the masks counts so much, compared with what it misses: the ground and flat faces cut off what is
/// too much, and nothing gives back what is missing.
const EXCESS: f64 = 1.0 / 3.0;

/// How well the mask of each view agrees with the hull of the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Consistency {
    /// Per view the overlap of its mask and the projection of the hull, as intersection over union of what nothing hides;
    /// `None` where both show nothing.
    pub overlap: Vec<Option<f32>>,
    /// The median of these.
    pub usual: f32,
    /// Per view whether its mask contradicts the others.
    pub contradicts: Vec<bool>,
}

impl Outlines {
    /// Compares each mask with the hull of the others, inside `bounds`; `None` where that tells nothing: of fewer than 6
    /// views, without a hull, or where a third of the masks contradict each other.
    pub fn consistency(&self, bounds: &Aabb<f32>) -> Option<Consistency> {
        if self.len() < LEAST_VIEWS {
            return None;
        }
        let forgiving = |share: f32| Vote { share, ..Vote::default() };
        let search = Search { vote: forgiving(SHARES[0]), fine: 24, ..Search::default() };
        let boxes = self.locate(bounds, &search).ok()?;
        let mut keep = vec![true; self.len()];
        let mut found = None;
        for share in SHARES {
            let others = self.only(&keep);
            let gates: Vec<Gate> = boxes.iter().map(|b| others.gate(b, &forgiving(share))).collect();
            let overlap: Vec<_> = self.views().par_iter().map(|view| view.overlap(&gates)).collect();
            let consistency = judged(overlap)?;
            keep = consistency.contradicts.iter().map(|wrong| !wrong).collect();
            found = Some(consistency);
        }
        found
    }

    /// How well a hull agrees with the masks, 0 to 1: of the lines of sight that a mask or the hull covers, the share that both
    /// do, where those that the hull covers alone count [`EXCESS`]; from about `samples` of all pictures. What hides the hull
    /// excuses nothing: a hull that grows behind opaque haze must show in the masks.
    pub(crate) fn agreement(&self, hull: &Gate, samples: usize) -> f64 {
        let all: usize = self.views().iter().map(|view| view.samples()).sum();
        let stride = (all / samples.max(1)).max(1);
        let counts = self.views().par_iter().enumerate().map(|(v, view)| {
            let (mut both, mut missed, mut excess) = (0_u64, 0_u64, 0_u64);
            // Another part of the samples in each view.
            for sample in (v % stride..view.samples()).step_by(stride) {
                let meets = view.ray(sample).is_some_and(|ray| hull.admits(&ray));
                match (view.shows(sample), meets) {
                    (true, true) => both += 1,
                    (true, false) => missed += 1,
                    (false, true) => excess += 1,
                    (false, false) => {}
                }
            }
            [both, missed, excess]
        });
        let [both, missed, excess] =
            counts.reduce(|| [0; 3], |a, b| std::array::from_fn(|k| a[k] + b[k])).map(|n| n as f64);
        let either = both + missed + EXCESS * excess;
        if either > 0.0 { both / either } else { 0.0 }
    }

    /// The hull in a box, for rays.
    fn gate(&self, bounds: &Aabb<f32>, vote: &Vote) -> Gate {
        let domain = Domain::with_longest(*bounds, Extent::Bounded, NODES);
        Gate::new(domain, &self.hull(&domain, vote).fraction)
    }
}

impl Outline {
    /// Intersection over union of the mask and the projection of hulls.
    fn overlap(&self, gates: &[Gate]) -> Option<f32> {
        let margin = gates.iter().map(|g| g.domain().voxel()).fold(0.0, f32::max);
        let (mut both, mut either) = (0_u32, 0_u32);
        for sample in 0..self.samples() {
            let shows = self.shows(sample);
            let enters = self.ray(sample).and_then(|ray| entry(gates, &ray));
            let hidden = |distance: f32| !shows && distance > self.occluded_beyond(sample) + margin;
            let met = enters.is_some_and(|distance| !hidden(distance));
            both += u32::from(shows && met);
            either += u32::from(shows || met);
        }
        (either > 0).then(|| both as f32 / either as f32)
    }
}

/// The distance at which a ray enters the first of the hulls.
fn entry(gates: &[Gate], ray: &Ray<f32>) -> Option<f32> {
    gates.iter().filter_map(|g| g.enters(ray)).min_by(f32::total_cmp)
}

/// Which views lie far below the others; `None` where the overlaps mean nothing.
fn judged(overlap: Vec<Option<f32>>) -> Option<Consistency> {
    let usual = median(overlap.iter().flatten().copied().collect())?;
    let deviation = median(overlap.iter().flatten().map(|o| (o - usual).abs()).collect())?;
    let least = usual - FAR.max(DEVIATIONS * deviation);
    let contradicts: Vec<bool> = overlap.iter().map(|o| o.is_some_and(|o| o < least)).collect();
    let wrong = contradicts.iter().filter(|w| **w).count() as f32;
    let tells = usual >= MEANINGLESS && wrong <= MOST_WRONG * contradicts.len() as f32;
    tells.then_some(Consistency { overlap, usual, contradicts })
}

fn median(mut values: Vec<f32>) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests;
