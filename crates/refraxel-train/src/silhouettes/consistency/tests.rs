use super::super::hull::tests::{Ball, cameras, silhouettes};
use super::super::outline::Silhouette;
use super::*;
use refraxel_core::{Vec3, vec3};
use refraxel_data::Mask;
use std::sync::Arc;

const BALL: [Ball; 1] = [Ball(vec3(0.03, -0.04, 0.05), 0.5)];
/// Edge of an image [pixel].
const SIZE: u32 = 64;
/// Not convex, and different from each side.
const BLOB: [Ball; 3] =
    [Ball(vec3(-0.3, 0.05, -0.1), 0.32), Ball(vec3(0.25, 0.1, 0.1), 0.28), Ball(vec3(0.1, -0.3, 0.35), 0.22)];
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
    let domain = Domain::with_longest(BOX, Extent::Bounded, 41);
    let hull = outlines.hull(&domain, vote);
    let node = |i: usize| vec3((i % 41) as f32, (i / 41 % 41) as f32, (i / 1681) as f32);
    let truth = |i: usize| {
        let x: Vec3<f64> = domain.position(node(i)).cast();
        things.iter().any(|Ball(centre, radius)| (x - *centre).length() < *radius)
    };
    let count = |f: &dyn Fn(bool, bool) -> bool| {
        (0..hull.fraction.len()).filter(|&i| f(truth(i), hull.fraction[i] >= 0.5)).count() as f64
    };
    count(&|a, b| a && b) / count(&|a, b| a || b)
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
