//! Bodies with a field of their own: a jump at the surface and bending inside.

use super::measures::median_and_largest;
use super::scene::{domain, options};
use super::sharp::{Impact, RADIUS, disc, impacts, kinds, trace};
use crate::index::LevelSet;
use crate::optics::{EventKind, Integrator, PathEnd, Tracer};
use crate::{Aabb, IndexGrid, Interpolation, Medium, Ray, Vec3, vec3};

/// n² = A − B r² inside a ball of radius 0.7: rays are ellipses, x'' = −B x in t.
const GRADED: [f64; 2] = [2.6, 1.4];

/// The exit direction of a ray at impact b along u.
fn exact_graded(ray: &Ray<f64>, u: Vec3<f64>, b: f64) -> Vec3<f64> {
    let [a, k] = GRADED;
    let square = a - k * RADIUS * RADIUS;
    let refract = |p: Vec3<f64>, m: Vec3<f64>, square: f64| {
        let along = p.dot(m);
        p + m * (along.signum() * (square - p.dot(p) + along * along).sqrt() - along)
    };
    let x = u * b - ray.direction * (RADIUS * RADIUS - b * b).sqrt();
    let p = refract(ray.direction, x / RADIUS, square);
    // |x(t)| = R again at tan(√B t) = −2 √B x·p / (|p|² − B R²).
    let root = k.sqrt();
    let turn = (-2.0 * root * x.dot(p)).atan2(square - k * RADIUS * RADIUS);
    let (sin, cos) = turn.sin_cos();
    let (end, momentum) = (x * cos + p * (sin / root), p * cos - x * (sin * root));
    refract(momentum, end / RADIUS, 1.0)
}

fn graded_errors(step: f64) -> [f64; 2] {
    let level = LevelSet::from_samples(Aabb::cube(1.0), [48; 3], |x: Vec3<f64>| x.length() - RADIUS);
    let n = |x: Vec3<f64>| (GRADED[0] - GRADED[1] * x.dot(x)).max(0.05).sqrt();
    let grid = IndexGrid::sharp_from_samples(level, [40; 3], Interpolation::CubicBSpline, n);
    let (medium, domain) = (Medium::new(vec![grid]).unwrap(), domain());
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, step));
    let off = impacts(disc(0.0, 0.98, 300)).into_iter().map(|Impact { ray, aside: u, b }| {
        let (found, exact) = (tracer.trace(&ray).exit.direction, exact_graded(&ray, u, b));
        found.cross(exact).length().atan2(found.dot(exact)).to_degrees()
    });
    median_and_largest(off.collect())
}

#[test]
fn a_graded_ball_with_a_jump_bends_rays_as_its_closed_form_in_second_order() {
    let (coarse, fine) = (graded_errors(0.5), graded_errors(0.25));
    assert!(coarse[0] < 0.01 && coarse[1] < 0.2, "{coarse:?} degrees");
    let order = (coarse[0] / fine[0]).log2();
    assert!((1.6..2.4).contains(&order), "order {order}: {coarse:?} {fine:?}");
}

#[test]
fn hops_through_flat_parts_of_a_body_change_nothing() {
    // A lens in the middle of a ball of n = 1.5; the border of the field is vacuum, outside the ball.
    let n = |x: Vec3<f64>| {
        let inner = 1.0 - x.dot(x) / 0.09;
        if x.length() > 0.8 { 1.0 } else { 1.5 + 0.2 * inner.max(0.0).powi(3) }
    };
    let grid = IndexGrid::from_control_values(Aabb::cube(1.0), [41; 3], Interpolation::CubicBSpline, n);
    let level = LevelSet::from_samples(Aabb::cube(1.0), [36; 3], |x: Vec3<f64>| x.length() - 0.6);
    let hopping = Medium::new(vec![grid.with_level_set(level)]).unwrap();
    let mut marching = hopping.clone();
    let grid = marching.region_mut(0);
    grid.find_flat_cells(Some(&vec![true; grid.coefficients().len()]));
    let (mut hops, mut saved) = (0, 0);
    for Impact { ray, .. } in impacts(disc(0.0, 0.8, 100)) {
        let (a, b) = (trace(&hopping, &ray), trace(&marching, &ray));
        hops += a.steps.iter().filter(|s| s.lattice > 1).count();
        saved += b.segments.len() - a.segments.len();
        assert!((a.exit.direction - b.exit.direction).length() < 1e-5);
        for pair in a.segments.windows(2).zip(&a.steps) {
            let ([s, next], step) = (pair.0, pair.1) else { unreachable!() };
            assert!((s.at(step.drift) - next.start).length() < 1e-12, "segments join");
        }
    }
    assert!(hops > 100 && saved > 1000, "{hops} hops saved {saved} segments");
}

#[test]
fn bodies_and_smooth_regions_stand_side_by_side() {
    // Ball, soft lens, ball in a row; the boxes touch.
    let at = |x: f64| Aabb::new(vec3(x - 0.5, -0.5, -0.5), vec3(x + 0.5, 0.5, 0.5));
    let sharp = |x: f64| {
        let center = vec3(x, 0.0, 0.0);
        IndexGrid::sharp(LevelSet::from_samples(at(x), [24; 3], |x| (x - center).length() - 0.35), 1.3)
    };
    let n = |x: Vec3<f64>| 1.0 + 0.2 * (-(x.dot(x) * 40.0)).exp();
    let soft = IndexGrid::from_samples(at(0.0), [24; 3], Interpolation::CubicBSpline, n);
    let medium = Medium::new(vec![soft, sharp(-1.0), sharp(1.0)]).unwrap();
    let ray = Ray { origin: vec3(-2.5, 0.05, 0.02), direction: vec3(1.0, 0.0, 0.0) };
    let path = trace(&medium, &ray);
    let mut visited: Vec<u16> =
        path.steps.iter().filter(|s| s.lattice > 0 || s.event.is_some()).map(|s| s.region).collect();
    visited.dedup();
    assert_eq!((visited, path.end), (vec![1, 0, 2], PathEnd::Escaped));
    assert_eq!(kinds(&path), [EventKind::Refraction; 4]);
    for pair in path.segments.windows(2).zip(&path.steps) {
        let ([a, b], step) = (pair.0, pair.1) else { unreachable!() };
        assert!((a.at(step.drift) - b.start).length() < 1e-12, "segments join");
    }
}
