use super::measures::median_and_largest;
use super::scene::{domain, medium, options};
use crate::index::tests::Sequence;
use crate::optics::{Integrator, Tracer};
use crate::{Aabb, IndexGrid, Interpolation, Medium, Ray, Vec3, vec3};
use std::f64::consts::PI;

/// Unit lens: n(r) for r < 1, vacuum around; 129³ nodes. Its ∇n jumps at r = 1, so samples serve as control values.
fn unit_lens(n: impl Fn(f64) -> f64) -> Medium<f64> {
    let n = |x: Vec3<f64>| n(x.length().min(1.0));
    let grid = IndexGrid::from_control_values(Aabb::cube(1.06), [129; 3], Interpolation::CubicBSpline, n);
    Medium::new(vec![grid]).unwrap()
}

/// Directions and impact points that favour no axis of the grid.
fn oblique_frames(count: usize) -> Vec<[Vec3<f64>; 3]> {
    let mut r = Sequence(5);
    let frame = |r: &mut Sequence| {
        let d = r.vector().normalized();
        let u = d.cross(r.vector()).normalized();
        [d, u, d.cross(u)]
    };
    (0..count).map(|_| frame(&mut r)).collect()
}

#[test]
fn a_luneburg_lens_focuses_parallel_rays_on_its_far_side() {
    let (medium, domain) = (unit_lens(|r| (2.0 - r * r).sqrt()), domain());
    let error = |integrator, step| {
        let tracer = Tracer::new(&medium, &domain, options(integrator, step));
        let mut r = Sequence(9);
        let misses = oblique_frames(150).into_iter().map(|[d, u, v]| {
            let (b, a) = (0.95 * r.next().abs().sqrt(), PI * r.next());
            let origin = (u * a.cos() + v * a.sin()) * b - d * 2.0;
            let exit = tracer.trace(&Ray { origin, direction: d }).exit;
            // Distance of the exit line from the focus, the point d of the unit sphere.
            (d - exit.origin).cross(exit.direction).length()
        });
        median_and_largest(misses.collect())
    };
    let [leapfrog, _] = error(Integrator::Leapfrog, 0.5);
    let [euler, _] = error(Integrator::ExplicitEuler, 0.5);
    let [reference, _] = error(Integrator::RungeKutta4, 0.5);
    assert!(leapfrog < 6e-4, "median miss {leapfrog}");
    assert!((reference / leapfrog - 1.0).abs() < 0.02, "the grid limits, not the step: {reference}");
    assert!(euler > 5.0 * leapfrog, "Euler {euler}");
}

#[test]
fn rays_in_a_maxwell_fish_eye_are_circles_that_meet_opposite_their_source() {
    let (medium, domain) = (unit_lens(|r| 2.0 / (1.0 + r * r)), domain());
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5));
    let (mut off_circle, mut misses) = (Vec::new(), Vec::new());
    let mut r = Sequence(21);
    for [normal, u, _] in oblique_frames(60) {
        // A ray into the unit sphere at −normal, tilted towards u.
        let tilt = 0.3 + 0.4 * r.next();
        let d = (normal + u * tilt).normalized();
        let source = -normal;
        let exit = tracer.trace(&Ray { origin: source - d * 0.8, direction: d });
        // Centre c = source + ρ N with N ⊥ d in the plane of the ray and |c|² + 1 = ρ².
        let n = (u - d * u.dot(d)).normalized();
        let rho = -1.0 / source.dot(n);
        let center = source + n * rho;
        let inside = exit.segments.iter().filter(|s| s.start.length() < 0.95);
        off_circle.extend(inside.map(|s| (s.start - center).length() - rho.abs()));
        misses.push((normal - exit.exit.origin).cross(exit.exit.direction).length());
    }
    let ([circle, _], [miss, _]) = (median_and_largest(off_circle), median_and_largest(misses));
    assert!(circle < 1e-3 && miss < 1e-3, "off the circle {circle}, off the opposite point {miss}");
}

#[test]
fn a_parabolic_fibre_has_its_pitch() {
    // n² = n0² (1 − α² r²) down to 1: x″ = −(n0 α)² x in t, p_z constant.
    let (n0, alpha) = (1.5_f64, 1.2_f64);
    let n = |x: Vec3<f64>| (n0 * n0 * (1.0 - alpha * alpha * (x.x * x.x + x.y * x.y))).max(1.0).sqrt();
    let (medium, domain) = (medium(2.2, 89, Interpolation::CubicBSpline, n), domain());
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5));
    let direction = vec3(0.24, 0.0, 1.0).normalized();
    let path = tracer.trace(&Ray { origin: vec3(0.0, 0.0, -1.8), direction });
    let crossings: Vec<f64> = path
        .segments
        .windows(2)
        .filter(|w| w[0].start.x * w[1].start.x < 0.0)
        .map(|w| {
            let f = w[0].start.x / (w[0].start.x - w[1].start.x);
            w[0].start.z + f * (w[1].start.z - w[0].start.z)
        })
        .collect();
    let half_pitch = PI * direction.z / alpha; // π p_z/(n0 α), p_z = n0 d_z
    assert!(!crossings.is_empty(), "no crossing");
    assert!((crossings[0] + 1.8 - half_pitch).abs() < 1e-3 * half_pitch, "{crossings:?} vs {half_pitch}");
}

#[test]
fn bouguers_invariant_is_kept_in_a_radial_field() {
    let (medium, domain) =
        (medium(1.06, 65, Interpolation::CubicBSpline, |x| 1.0 + 0.5 * (-(12.0 * x.dot(x))).exp()), domain());
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5));
    let mut drift: f64 = 0.0;
    for [d, u, _] in oblique_frames(30) {
        let ray = Ray { origin: u * 0.25 - d * 2.0, direction: d };
        let invariant = ray.origin.cross(ray.direction); // n r sin φ, and the plane of the ray
        for s in &tracer.trace(&ray).segments {
            drift = drift.max((s.start.cross(s.momentum) - invariant).length() / 0.25);
        }
    }
    // The B-spline on the grid is not exactly radial: that is what is left.
    assert!(drift < 1e-4, "relative drift {drift}");
}
