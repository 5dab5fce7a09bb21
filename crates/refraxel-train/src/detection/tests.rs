//! A ball among residuals that leave a part of it out.

use super::Hints;
use super::evidence::Evidence;
use super::hull::Carved;
use super::look::{Looking, look};
use super::refine::{Refining, Votes};
use super::separation::separation;
use crate::cancel::Cancel;
use crate::model::Gate;
use crate::model::polyhedron::Plane;
use crate::random::Random;
use crate::rays::pixel_ray;
use crate::silhouettes::around::cameras_between;
use refraxel_core::{Aabb, Camera, Domain, Extent, Ray, Vec3, vec3};
use std::cell::Cell;

const RADIUS: f32 = 0.5;
pub(super) const BOX: Aabb<f32> = Aabb { min: vec3(-1.2, -1.2, -1.2), max: vec3(1.2, 1.2, 1.2) };

/// Forty views of 48² cells from all around, with these residuals of their rays.
pub(super) fn views_of(residual: impl Fn(&Ray<f32>) -> f32) -> Vec<Evidence> {
    let view = |camera: Camera| {
        let rays: Vec<_> = (0..48 * 48).map(|cell| pixel_ray(&camera, cell)).collect();
        let residual = rays.iter().flatten().map(&residual).collect();
        Evidence { camera, rays, residual, beyond: vec![9.0; 48 * 48] }
    };
    cameras_between([1.0, -1.0], 40, 0.7, 48).into_iter().map(view).collect()
}

/// Views of a ball before a wall: a part of its cells is explained, as plain things seen through glass are, and a tenth of the
/// wall is not.
fn views(explained: f64) -> Vec<Evidence> {
    let random = Random::new(1);
    let count = Cell::new(0);
    views_of(|ray| {
        let u = random.uniform(0, count.replace(count.get() + 1));
        let foot = ray.at(-ray.origin.dot(ray.direction));
        let unexplained = if foot.length() < RADIUS { u > explained } else { u > 0.9 };
        if unexplained { 0.2 } else { 0.02 }
    })
}

pub(super) fn gate(inside: impl Fn(Vec3<f32>) -> bool) -> Gate {
    let domain = Domain::with_longest(BOX, Extent::Bounded, 48);
    let total = domain.resolution.map(|n| n as usize).iter().product();
    let share: Vec<f32> = (0..total).map(|j| f32::from(u8::from(inside(domain.place(j))))).collect();
    Gate::new(domain, &share)
}

fn ball(centre: Vec3<f32>, radius: f32) -> Gate {
    gate(|x| (x - centre).length() < radius)
}

fn overlap(gate: &Gate) -> f64 {
    overlap_of(gate, |x| x.length() < RADIUS)
}

/// Intersection over union of a shape and the truth, by points.
pub(super) fn overlap_of(gate: &Gate, is_inside: impl Fn(Vec3<f32>) -> bool) -> f64 {
    let random = Random::new(2);
    let (mut both, mut either) = (0, 0);
    for k in 0..40_000 {
        let x = Vec3::from([0, 1, 2].map(|a| 2.4 * random.uniform(k, a) as f32 - 1.2));
        let (found, truth) = (gate.is_inside(x), is_inside(x));
        both += u32::from(found && truth);
        either += u32::from(found || truth);
    }
    f64::from(both) / f64::from(either)
}

const HOW: Refining = Refining { nodes: 26, ground: None };

fn refined(first: &Carved, views: &[Evidence], how: Refining) -> Gate {
    Votes::new(first, views, how, &Hints::default(), &Cancel::new()).shape(0.15, &Hints::default())
}

#[test]
fn a_ball_is_found_from_a_part_of_it_and_from_more_than_it() {
    let views = views(0.33);
    for (centre, radius) in [(vec3(0.08, 0.0, 0.0), 0.38), (vec3(0.0, 0.1, 0.1), 0.7)] {
        let first = Carved::of(&ball(centre, radius), &BOX).unwrap();
        let (before, found) = (overlap(&first.gate), overlap(&refined(&first, &views, HOW)));
        assert!(before < 0.5 && found > 0.8, "{before} {found}");
    }
}

#[test]
fn nothing_is_taken_for_refractive_below_the_ground() {
    let first = Carved::of(&ball(Vec3::zero(), 0.4), &BOX).unwrap();
    let ground = Plane::facing(vec3(0.0, 0.0, 1.0), 0.1);
    let found = refined(&first, &views(0.33), Refining { ground: Some(ground), ..HOW });
    let height = |z: f32| ground.height(vec3(0.0, 0.0, z));
    assert!(found.is_inside(vec3(0.0, 0.0, 0.3)), "{}", height(0.3));
    assert!(!found.is_inside(vec3(0.0, 0.0, -0.3)), "{}", height(-0.3));
}

#[test]
fn the_true_shape_separates_best_and_residuals_that_are_nowhere_in_particular_do_not() {
    let views = views(0.33);
    let share = |views: &[Evidence], gate: &Gate| separation(&views.iter().collect::<Vec<_>>(), gate).share;
    let [small, right, large] = [0.3, RADIUS, 0.8].map(|r| share(&views, &ball(Vec3::zero(), r)));
    assert!(right > small + 0.05 && right > large + 0.05 && right > 0.2, "{small} {right} {large}");
    let random = Random::new(5);
    let scattered: Vec<Evidence> = views
        .into_iter()
        .zip(0..)
        .map(|(v, k)| {
            let residual = (0..v.residual.len()).map(|c| 0.1 * random.uniform(k, c as u64) as f32).collect();
            Evidence { residual, ..v }
        })
        .collect();
    let nothing = share(&scattered, &ball(Vec3::zero(), RADIUS));
    assert!(nothing < 0.01, "{nothing}");
}

#[test]
fn a_look_finds_the_ball_and_one_that_is_stopped_does_not_say_that_nothing_is_there() {
    let views = views(0.33);
    let hints = Hints::default();
    let how = Looking { bounds: BOX, voxel: 0.1, cell_at: &|_| 0.06, needed: 0.13, hints: &hints };
    let cancel = Cancel::new();
    let found = look(&views, &how, &cancel).unwrap().gate.unwrap();
    assert!(overlap(&found) > 0.7, "{}", overlap(&found));
    cancel.cancel();
    assert!(look(&views, &how, &cancel).is_err());
}
