//! The adjoint of paths through bodies in bodies against central differences.

use super::mirrors::{Mirrored, mirror_errors, mirrors};
use super::scene::domain;
use super::sharp_gradients::{Functional, path_errors, rays, tracer};
use crate::index::LevelSet;
use crate::index::tests::Sequence;
use crate::segment::SegmentAdjoint;
use crate::{Aabb, IndexGrid, Interpolation, Medium, Ray, Vec3, vec3};

/// As for single bodies.
const TOLERANCE: f64 = 1e-7;
/// With one more division by a sine.
const MIRRORED_TOLERANCE: f64 = 1e-6;

/// A body with another in it, which reaches out on one side; both of one index or with fields of their own.
fn scene(graded: bool) -> Medium<f64> {
    let outer = |x: Vec3<f64>| x.length() - 0.65 - 0.06 * (4.0 * x.x).sin() * (3.0 * x.y).cos();
    let inner = |x: Vec3<f64>| (x - vec3(0.25, 0.1, 0.0)).length() - 0.42 - 0.04 * (5.0 * x.z).sin();
    let body = |phi: &dyn Fn(Vec3<f64>) -> f64, n: f64, nodes: [u32; 3]| {
        let level = LevelSet::from_samples(Aabb::cube(1.0), nodes, phi);
        if !graded {
            return IndexGrid::sharp(level, n);
        }
        let n = |x: Vec3<f64>| n + 0.15 * (3.0 * x.x).sin() * (2.0 * x.y + 1.0).cos() + 0.1 * x.z;
        IndexGrid::sharp_from_samples(level, [14, 15, 16], Interpolation::CubicBSpline, n)
    };
    Medium::new(vec![body(&outer, 1.6, [24, 26, 25]), body(&inner, 1.25, [27, 25, 26])]).unwrap()
}

#[test]
fn gradients_by_both_media_both_surfaces_and_the_ray_match_central_differences() {
    for graded in [false, true] {
        let (mut medium, mut r) = (scene(graded), Sequence(11));
        let (mut inner, mut most) = (0, 0);
        for (ray, path) in rays(&medium, 14) {
            let both = |s: &super::super::Step<f64>| {
                s.within.is_some() && s.event.is_some_and(|e| e.beyond.is_some())
            };
            inner += path.steps.iter().filter(|s| both(s)).count();
            most = most.max(path.events().count());
            let worst = path_errors(&mut medium, &ray, &path, &Functional::random(&path, &mut r));
            assert!(worst.iter().all(|e| *e < TOLERANCE), "level sets, indices, ray: {worst:?} {path:?}");
        }
        assert!(inner > 12 && most >= 3, "{inner} events between two media, at most {most} on a path");
    }
}

#[test]
fn gradients_of_what_inner_surfaces_mirror_match_central_differences() {
    for graded in [false, true] {
        let (mut medium, mut r) = (scene(graded), Sequence(12));
        let mut inner = 0;
        for (ray, path) in rays(&medium, 10) {
            let found = mirrors(&tracer(&medium, &domain()), &path);
            inner += found.iter().filter(|m| m.within == Some(0) || m.region == 1).count();
            let f = Mirrored::random(&path, found.len(), &mut r);
            let worst = mirror_errors(&mut medium, &ray, &path, &f);
            assert!(worst.iter().all(|e| *e < MIRRORED_TOLERANCE), "level sets, indices, ray: {worst:?}");
        }
        assert!(inner > 12, "{inner}");
    }
}

#[test]
fn derivatives_of_traced_paths_by_both_indices_are_those_of_replayed_ones() {
    let (mut medium, domain, e) = (scene(false), domain(), 1e-6);
    let mut r = Sequence(13);
    for (ray, path) in rays(&medium, 10) {
        let mut f = Functional::random(&path, &mut r);
        f.segments.fill(SegmentAdjoint::default());
        f.exit.origin = Vec3::zero();
        let mut grad = medium.zero_gradient();
        tracer(&medium, &domain).vjp(&ray, &path, &f.adjoint(&[]), &mut grad);
        for region in 0..2 {
            let n = medium.regions()[region].interior_index().unwrap();
            // dw = n dn
            let exact = n * grad.index[region].iter().sum::<f64>();
            let mut by_index = |e: f64| {
                medium.region_mut(region).set_interior_index(n + e);
                f.of(&tracer(&medium, &domain).trace(&ray))
            };
            let fd = (by_index(e) - by_index(-e)) / (2.0 * e);
            by_index(0.0);
            assert!((fd - exact).abs() < 1e-6 * (exact.abs() + 1.0), "region {region}: {fd} vs {exact}");
        }
    }
}

#[test]
fn the_adjoint_through_nested_bodies_is_the_transpose_of_its_derivative() {
    // ⟨v, J u⟩ with J u by central differences along a random direction of all that a path depends on.
    for graded in [false, true] {
        let (medium, domain, e) = (scene(graded), domain(), 1e-6);
        let mut r = Sequence(14);
        for (ray, path) in rays(&medium, 12) {
            let count = mirrors(&tracer(&medium, &domain), &path).len();
            let v = Mirrored::random(&path, count, &mut r);
            let mut grad = medium.zero_gradient();
            let d = tracer(&medium, &domain).vjp(&ray, &path, &v.path.adjoint(&v.reflections), &mut grad);
            let seed = r.0;
            let moved = |e: f64| {
                let (mut medium, mut r) = (medium.clone(), Sequence(seed));
                for region in 0..2 {
                    let grid = medium.region_mut(region);
                    grid.coefficients_mut().iter_mut().for_each(|c| *c += e * r.next());
                    let level = grid.level_set_mut().unwrap();
                    for j in 0..level.coefficients().len() {
                        let by = e * r.next();
                        if level.is_parameter(j) {
                            level.coefficients_mut()[j] += by;
                        }
                    }
                }
                let ray =
                    Ray { origin: ray.origin + r.vector() * e, direction: ray.direction + r.vector() * e };
                v.of(&tracer(&medium, &domain), &ray, &path)
            };
            let forward = (moved(e) - moved(-e)) / (2.0 * e);
            let mut r = Sequence(seed);
            let mut backward = 0.0;
            for region in 0..2 {
                backward += grad.index[region].iter().map(|g| g * r.next()).sum::<f64>();
                backward += grad.level_set[region].iter().map(|g| g * r.next()).sum::<f64>();
            }
            backward += d.origin.dot(r.vector()) + d.direction.dot(r.vector());
            assert!((forward - backward).abs() < 1e-6 * (1.0 + backward.abs()), "{forward} {backward}");
        }
    }
}
