//! Cameras that are disturbed and find back.

use super::gauge::without_gauge;
use super::*;
use crate::backend::RayGradient;
use crate::random::Random;
use refraxel_core::{Camera, Pose, Ray, Vec3, vec3};

/// A coloured plane z = 0: what a ray shows, and dLoss/d(ray) for a target.
fn shown(ray: &Ray<f32>) -> [f32; 3] {
    let x = ray.at(-ray.origin.z / ray.direction.z);
    [(3.0 * x.x).sin(), (2.0 * x.y + 1.0).sin(), (2.0 * x.x - 3.0 * x.y).cos()].map(|c| 0.5 + 0.3 * c)
}

fn gradient(ray: &Ray<f32>, target: [f32; 3]) -> RayGradient {
    let seen = shown(ray);
    let residual = [0, 1, 2].map(|c| seen[c] - target[c]);
    let loss = |ray: &Ray<f32>| {
        let seen = shown(ray);
        (0..3).map(|c| (seen[c] - target[c]).powi(2)).sum::<f32>()
    };
    const H: f32 = 1e-3;
    let mut out = RayGradient { residual, ..RayGradient::zero() };
    for a in 0..3 {
        let moved = |by: f32| {
            let (mut o, mut d) = (*ray, *ray);
            o.origin[a] += by;
            d.direction[a] += by;
            [loss(&o), loss(&d)]
        };
        let (up, down) = (moved(H), moved(-H));
        (out.origin[a], out.direction[a]) = ((up[0] - down[0]) / (2.0 * H), (up[1] - down[1]) / (2.0 * H));
    }
    out
}

fn cameras() -> Vec<Camera> {
    let around = |k: u32| {
        let angle = 2.0 * f64::from(k);
        let eye = vec3(3.0 * angle.cos(), 3.0 * angle.sin(), 2.5 + 0.2 * f64::from(k % 3));
        Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [40, 40])
    };
    (0..7).map(around).collect()
}

fn current(poses: &Poses) -> Vec<Pose> {
    (0..poses.len()).map(|view| poses.pose(view)).collect()
}

/// Corrections of half a degree and one part in a hundred, without what all cameras do together.
fn disturbances(given: &[Pose], unit: f64) -> Vec<Correction> {
    let random = Random::new(4);
    let number = |k: usize, i: u64| random.uniform(k as u64, i) - 0.5;
    let of = |k: usize| Correction {
        rotation: vec3(number(k, 0), number(k, 1), number(k, 2)) * 0.015,
        translation: vec3(number(k, 3), number(k, 4), number(k, 5)) * 0.06,
    };
    let mut all: Vec<Correction> = (0..given.len()).map(of).collect();
    without_gauge(given, unit, true, &mut all);
    all
}

#[test]
fn disturbed_cameras_find_back() {
    let (cameras, unit) = (cameras(), 4.0);
    let truth: Vec<Pose> = cameras.iter().map(|c| c.world_from_camera).collect();
    let off = disturbances(&truth, unit);
    // Given: the true poses moved the other way, so that the corrections found are `off`.
    let given: Vec<Pose> = truth
        .iter()
        .zip(&off)
        .map(|(p, c)| Correction { rotation: -c.rotation, translation: -c.translation }.of(p))
        .collect();
    let (mut poses, random) = (Poses::new(given, unit), Random::new(9));
    let far = |poses: &Poses| {
        let current = current(poses);
        let distance = |(a, b): (&Pose, &Pose)| {
            let turn = (a.rotation.transpose() * b.rotation).rows();
            let angle = (0..3)
                .map(|i| (0..3).filter(|j| *j != i).map(|j| turn[i][j].powi(2)).sum::<f64>())
                .sum::<f64>();
            (angle / 2.0).sqrt().max((a.translation - b.translation).length() / unit)
        };
        current.iter().zip(&truth).map(distance).fold(0.0, f64::max)
    };
    let before = far(&poses);
    for step in 0..60 {
        let (mut views, mut rays, mut gradients) = (Vec::new(), Vec::new(), Vec::new());
        let current = current(&poses);
        for k in 0..700_u64 {
            let view = (k % 7) as usize;
            let at = [0, 1].map(|a| 40.0 * random.uniform(step, 2 * k + a));
            let target = shown(&cameras[view].ray(at[0], at[1]).unwrap().cast());
            let moved = Camera { world_from_camera: current[view], ..cameras[view] };
            let ray: Ray<f32> = moved.ray(at[0], at[1]).unwrap().cast();
            views.push(view);
            gradients.push(gradient(&ray, target));
            rays.push(ray);
        }
        poses.learn(&views, &rays, &gradients, &[], PoseRate { memory: 0.7, pixel: 0.01, most: 0.01 });
    }
    let after = far(&poses);
    assert!(before > 4e-3 && after < 0.1 * before, "{before} {after}");
}

#[test]
fn a_wrong_lens_is_found_together_with_wrong_poses() {
    let unit = 4.0;
    let truth = LensCorrection { focal: 0.04, radial: -0.03 };
    let given = cameras();
    let taken: Vec<Camera> = given.iter().map(|c| truth.of(c)).collect();
    let poses: Vec<Pose> = given.iter().map(|c| c.world_from_camera).collect();
    let off = disturbances(&poses, unit);
    let wrong: Vec<Pose> = poses.iter().zip(&off).map(|(p, c)| c.of(p)).collect();
    let random = Random::new(5);
    let mut found = Poses::new(wrong, unit).with_lenses(&given);
    for step in 0..150 {
        let (mut views, mut rays, mut gradients, mut slopes) = (vec![], vec![], vec![], vec![]);
        for k in 0..1400_u64 {
            let view = (k % 7) as usize;
            let at = [0, 1].map(|a| 40.0 * random.uniform(step, 2 * k + a));
            let target = shown(&taken[view].ray(at[0], at[1]).unwrap().cast());
            let camera = found.camera(view, &given[view]);
            let ray: Ray<f32> = camera.ray(at[0], at[1]).unwrap().cast();
            views.push(view);
            gradients.push(gradient(&ray, target));
            slopes.push(lens_slopes(&camera, &ray));
            rays.push(ray);
        }
        let rate = PoseRate { memory: 0.7, pixel: 0.01, most: 0.01 };
        found.learn(&views, &rays, &gradients, &slopes, rate);
    }
    let lens = found.lens(0);
    assert!((lens.focal - truth.focal).abs() < 0.1 * truth.focal, "{lens:?}");
    assert!((lens.radial - truth.radial).abs() < 0.15 * truth.radial.abs(), "{lens:?}");
    let shift = found.shift().lens.unwrap();
    assert!((shift.focal - lens.focal.exp()).abs() < 1e-12 && shift.radial == lens.radial);
    let numbers = (found.to_numbers(), found.lenses_to_numbers().unwrap());
    let again = Poses::of_numbers(&numbers.0).unwrap().with_lenses_of_numbers(&numbers.1);
    assert_eq!(again, Some(found.clone()));
    assert_eq!(found.forgotten().lens(3), LensCorrection::default());
}

#[test]
fn numbers_say_all_of_poses() {
    let given: Vec<Pose> = cameras().iter().map(|c| c.world_from_camera).collect();
    let mut poses = Poses::new(given.clone(), 4.0);
    let ray: Ray<f32> = cameras()[2].ray(10.0, 20.0).unwrap().cast();
    poses.learn(
        &[2],
        &[ray],
        &[gradient(&ray, [0.1, 0.9, 0.4])],
        &[],
        PoseRate { memory: 0.9, pixel: 0.01, most: 0.01 },
    );
    assert_eq!(Poses::of_numbers(&poses.to_numbers()), Some(poses.clone()));
    assert!(poses.shift().largest_turn > 0.0);
    let [few, infinite] = [&[4.0, 0.0][..], &[f64::INFINITY]];
    assert!(Poses::of_numbers(few).is_none() && Poses::of_numbers(infinite).is_none());
    assert_eq!(poses.forgotten(), Poses::new(given, 4.0));
}
