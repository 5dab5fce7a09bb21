use super::super::around::{Ball, cameras, iou, silhouettes};
use super::carve::node_of;
use super::{Hull, Vote};
use crate::silhouettes::{Outlines, Silhouette};
use refraxel_core::{Aabb, Domain, Extent, Lens, vec3};

fn domain(half: f32, nodes: u32) -> Domain<f32> {
    Domain::with_longest(Aabb::cube(half), Extent::Bounded, nodes)
}

/// Distances of the hull's nodes within `band` voxels of the ball's surface, minus the true ones [voxel].
fn errors(hull: &Hull, ball: Ball, band: f64) -> Vec<f64> {
    let (n, voxel) = (hull.domain.resolution.map(|n| n as usize), f64::from(hull.domain.voxel()));
    let nodes = (0..hull.distance.len()).filter_map(|i| {
        let x = hull.domain.position(node_of(i % n[0], i / n[0], n)).cast::<f64>();
        let truth = ((x - ball.0).length() - ball.1) / voxel;
        (truth.abs() < band).then(|| f64::from(hull.distance[i]) / voxel - truth)
    });
    nodes.collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

const BALL: Ball = Ball(vec3(0.03, -0.04, 0.05), 0.5);

fn ball_hull(share: f32) -> Hull {
    let outlines = Outlines::new(&silhouettes(&cameras(60, 80), &[BALL], &[]));
    outlines.hull(&domain(0.62, 41), &Vote { share, ..Vote::default() })
}

#[test]
fn distance_and_volume_of_a_ball_have_no_bias_when_all_views_must_agree() {
    let hull = ball_hull(1.0);
    let e = errors(&hull, BALL, 2.0);
    let worst = e.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
    assert!(mean(&e).abs() < 0.02 && worst < 0.15, "mean {}, worst {worst}", mean(&e));
    let volume = 4.0 / 3.0 * std::f64::consts::PI * BALL.1.powi(3);
    assert!((hull.volume() / volume - 1.0).abs() < 0.005, "{}", hull.volume() / volume);
}

#[test]
fn overruling_one_view_in_twenty_grows_a_ball_by_less_than_a_tenth_of_a_voxel() {
    let hull = ball_hull(0.95);
    let e = mean(&errors(&hull, BALL, 2.0));
    assert!(e < 0.0 && e > -0.1, "{e}");
    let volume = 4.0 / 3.0 * std::f64::consts::PI * BALL.1.powi(3);
    assert!((1.0..1.015).contains(&(hull.volume() / volume)));
}

#[test]
fn views_behind_something_opaque_abstain() {
    // A third of all views see only part of the glass.
    let opaque = [Ball(vec3(1.1, 0.2, 0.1), 0.45), Ball(vec3(-0.6, -0.9, 0.2), 0.4)];
    let mut views = silhouettes(&cameras(60, 80), &[BALL], &opaque);
    let iou =
        |views: &[Silhouette]| iou(&Outlines::new(views).hull(&domain(0.62, 31), &Vote::default()), &[BALL]);
    let with = iou(&views);
    views.iter_mut().for_each(|v| v.occluders = None);
    let without = iou(&views);
    assert!(with > 0.96 && without < 0.8, "{with} {without}");
}

#[test]
fn places_that_few_views_see_are_outside() {
    let outlines = Outlines::new(&silhouettes(&cameras(2, 40), &[BALL], &[]));
    let hull = outlines.hull(&domain(0.62, 11), &Vote::default());
    assert!(hull.fraction.iter().all(|&f| f == 0.0) && hull.distance.iter().all(|&d| d > 1.0));
}

#[test]
fn a_general_lens_carves_what_a_pinhole_carves() {
    let pinhole = cameras(30, 60);
    let mut other = pinhole.clone();
    other.iter_mut().for_each(|c| c.lens = Lens::OpenCv { k: [1e-9, 0.0, 0.0, 0.0], p: [0.0; 2] });
    let [a, b] = [pinhole, other]
        .map(|c| Outlines::new(&silhouettes(&c, &[BALL], &[])).hull(&domain(0.62, 21), &Vote::default()));
    // A pinhole measures the footprint of a pixel along its axis, a general lens along the ray.
    assert!(a.fraction.iter().zip(&b.fraction).filter(|(a, b)| (*a - *b).abs() > 0.05).count() < 10);
}

#[test]
fn thinned_maps_carve_the_same() {
    let views = silhouettes(&cameras(16, 240), &[BALL], &[]);
    let [a, b] =
        [240, 80].map(|size| Outlines::with_maps(&views, size).hull(&domain(0.62, 21), &Vote::default()));
    let voxel = a.domain.voxel();
    let near = a.distance.iter().zip(&b.distance).filter(|(a, _)| a.abs() < 2.0 * voxel);
    let worst = near.fold(0.0, |m: f32, (a, b)| m.max((a - b).abs()));
    assert!(worst < 0.1 * voxel && (a.volume() / b.volume() - 1.0).abs() < 0.005, "{worst}");
}
