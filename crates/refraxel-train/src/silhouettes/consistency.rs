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
use refraxel_data::quantile;

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
        let of = |b: &Aabb<f32>| Domain::with_longest(*b, Extent::Bounded, NODES);
        let mut keep = vec![true; self.len()];
        let mut found = None;
        for share in SHARES {
            let others = self.only(&keep);
            let gates: Vec<Gate> = boxes.iter().map(|b| others.gate(of(b), &forgiving(share))).collect();
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
    let known = || overlap.iter().flatten().copied();
    let usual = quantile(known(), 0.5)?;
    let deviation = quantile(known().map(|o| (o - usual).abs()), 0.5)?;
    let least = usual - FAR.max(DEVIATIONS * deviation);
    let contradicts: Vec<bool> = overlap.iter().map(|o| o.is_some_and(|o| o < least)).collect();
    let wrong = contradicts.iter().filter(|w| **w).count() as f32;
    let tells = usual >= MEANINGLESS && wrong <= MOST_WRONG * contradicts.len() as f32;
    tells.then_some(Consistency { overlap, usual, contradicts })
}

#[cfg(test)]
mod tests {
    use super::super::around::{self, Ball, cameras, silhouettes};
    use super::super::outline::Silhouette;
    use super::*;
    use refraxel_core::vec3;
    use refraxel_data::Mask;
    use std::sync::Arc;

    const BALL: [Ball; 1] = [Ball(vec3(0.03, -0.04, 0.05), 0.5)];
    /// Edge of an image [pixel].
    const SIZE: u32 = 64;
    /// Not convex, and different from each side.
    const BLOB: [Ball; 3] = [
        Ball(vec3(-0.3, 0.05, -0.1), 0.32),
        Ball(vec3(0.25, 0.1, 0.1), 0.28),
        Ball(vec3(0.1, -0.3, 0.35), 0.22),
    ];
    const BOX: Aabb<f32> = Aabb { min: vec3(-0.8, -0.8, -0.8), max: vec3(0.8, 0.8, 0.8) };

    fn views(things: &[Ball], count: usize) -> Vec<Silhouette> {
        silhouettes(&cameras(count, SIZE), things, &[])
    }

    fn change(view: &mut Silhouette, change: impl FnOnce(&mut Mask)) {
        change(Arc::make_mut(&mut view.mask));
    }

    fn emptied(view: &mut Silhouette) {
        change(view, |m| m.coverage.fill(0));
    }

    /// Exchanges the masks of two views.
    fn swapped(views: &mut [Silhouette], a: usize, b: usize) {
        let mask = views[a].mask.clone();
        views[a].mask = std::mem::replace(&mut views[b].mask, mask);
    }

    /// The mask grown by `by` pixels, or shrunk where it is negative.
    fn offset(view: &mut Silhouette, by: isize) {
        change(view, |m| {
            let (old, [w, h]) = (m.coverage.clone(), [m.width as isize, m.height as isize]);
            let r = by.abs();
            for i in 0..w * h {
                let around = (-r..=r).flat_map(|dy| (-r..=r).map(move |dx| (dx, dy)));
                let disc = around.filter(|(dx, dy)| dx * dx + dy * dy <= r * r);
                let at = |(dx, dy): (isize, isize)| {
                    old[((i / w + dy).clamp(0, h - 1) * w + (i % w + dx).clamp(0, w - 1)) as usize]
                };
                let all = disc.map(at);
                m.coverage[i as usize] = if by > 0 { all.max() } else { all.min() }.unwrap_or(0);
            }
        });
    }

    /// A tenth of 40 views without mask, a twentieth with that of another.
    fn damaged(things: &[Ball]) -> (Vec<Silhouette>, Vec<usize>) {
        let mut views = views(things, 40);
        [3, 11, 22, 34].into_iter().for_each(|v| emptied(&mut views[v]));
        swapped(&mut views, 7, 19);
        (views, vec![3, 7, 11, 19, 22, 34])
    }

    fn contradicting(views: &[Silhouette]) -> Vec<usize> {
        let found = Outlines::new(views).consistency(&BOX).unwrap();
        (0..views.len()).filter(|&v| found.contradicts[v]).collect()
    }

    /// Intersection over union of the hull and the things.
    fn iou(outlines: &Outlines, things: &[Ball], vote: &Vote) -> f64 {
        around::iou(&outlines.hull(&Domain::with_longest(BOX, Extent::Bounded, 41), vote), things)
    }

    /// The outlines of the views that do not contradict the others.
    fn consistent(views: &[Silhouette]) -> Outlines {
        let outlines = Outlines::new(views);
        let found = outlines.consistency(&BOX).unwrap();
        outlines.only(&found.contradicts.iter().map(|wrong| !wrong).collect::<Vec<_>>())
    }

    #[test]
    fn missing_and_swapped_masks_are_found_and_no_others() {
        let (views, wrong) = damaged(&BLOB);
        assert_eq!(contradicting(&views), wrong);
    }

    #[test]
    fn a_sixth_of_wrong_masks_costs_a_hull_nothing_once_they_are_left_out() {
        const LOST: f64 = 0.015; // fewer views carve less
        for things in [&BALL[..], &BLOB] {
            let clean = iou(&Outlines::new(&views(things, 40)), things, &Vote::default());
            let (rough, _) = damaged(things);
            let naive = iou(&Outlines::new(&rough), things, &Vote::default());
            let robust = iou(&consistent(&rough), things, &Vote::default());
            assert!(robust > clean - LOST && naive < 0.3, "clean {clean}, robust {robust}, naive {naive}");
        }
    }

    #[test]
    fn masks_that_are_all_a_little_too_small_or_too_large_do_not_contradict_each_other() {
        for things in [&BALL[..], &BLOB] {
            for by in [-3, 0, 3] {
                let mut views = views(things, 40);
                views.iter_mut().for_each(|v| offset(v, by));
                assert_eq!(contradicting(&views), [0; 0], "by {by} pixels");
            }
        }
    }

    #[test]
    fn a_single_wrong_mask_of_twelve_is_found() {
        let clean = iou(&Outlines::new(&views(&BLOB, 12)), &BLOB, &Vote::default());
        for wrong in [0, 5, 10] {
            let mut views = views(&BLOB, 12);
            emptied(&mut views[wrong]);
            assert_eq!(contradicting(&views), [wrong]);
            let robust = iou(&consistent(&views), &BLOB, &Vote::default());
            let naive = iou(&Outlines::new(&views), &BLOB, &Vote::default());
            // One view in twelve is missing: the hull is a little larger.
            assert!(robust > clean - 0.06 && naive == 0.0, "clean {clean}, robust {robust}, naive {naive}");
        }
    }

    #[test]
    fn glass_that_opaque_things_hide_does_not_make_masks_wrong() {
        let opaque = [Ball(vec3(1.1, 0.2, 0.1), 0.45), Ball(vec3(-0.6, -0.9, 0.2), 0.4)];
        let views = silhouettes(&cameras(40, SIZE), &BLOB, &opaque);
        assert_eq!(contradicting(&views), [0; 0]);
    }

    #[test]
    fn where_most_masks_disagree_or_few_are_there_nothing_is_said() {
        let mut half = views(&BLOB, 20);
        half.iter_mut().step_by(2).for_each(emptied);
        assert_eq!(Outlines::new(&half).consistency(&BOX), None);
        assert_eq!(Outlines::new(&views(&BLOB, 5)).consistency(&BOX), None);
    }

    #[test]
    fn one_dissenting_view_of_twelve_cannot_carve_when_the_vote_allows_it() {
        let mut views = views(&BLOB, 12);
        // Half of one mask is missing.
        change(&mut views[4], |m| m.coverage[..(SIZE * SIZE / 2) as usize].fill(0));
        let of = |dissent| iou(&Outlines::new(&views), &BLOB, &Vote { dissent, ..Vote::default() });
        let (naive, robust) = (of(0), of(1));
        assert!(robust > 0.75 && naive < 0.6, "robust {robust}, naive {naive}");
    }
}
