use super::scene::{domain, options, ramp};
use crate::optics::{Integrator, Options, PathEnd, Tracer};
use crate::{Aabb, IndexGrid, Interpolation, Medium, Ray, Vec3, vec3};

/// A wide slab of glass, n = 1.5 for |z| < 0.5; the transition is about 8 voxels wide.
fn slab() -> Medium<f64> {
    let bounds = Aabb::new(vec3(-4.0, -2.0, -1.2), vec3(4.0, 2.0, 1.2));
    let n = |x: Vec3<f64>| 1.0 + 0.5 * ramp(x.z.abs() - 0.5, 0.05);
    // Control values: prefiltering would ring across the slab from the sides of the box.
    let grid = IndexGrid::from_control_values(bounds, [41, 21, 97], Interpolation::CubicBSpline, n);
    Medium::new(vec![grid]).unwrap()
}

/// A ray of angle `angle` to −z that meets z = 0 near the axis, from outside.
fn from_above(angle: f64) -> Ray<f64> {
    let direction = vec3(angle.sin() * 0.8, angle.sin() * 0.6, -angle.cos());
    Ray { origin: vec3(0.01, 0.02, 0.0) - direction * 1.8, direction }
}

#[test]
fn a_planar_transition_keeps_tangential_momentum_to_rounding_and_refracts_as_snell() {
    let (medium, domain) = (slab(), domain());
    for angle in [0.1_f64, 0.4, 0.7] {
        let ray = from_above(angle);
        let path = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5)).trace(&ray);
        let inside = path.segments.iter().find(|s| s.start.z < 0.1).unwrap();
        for s in &path.segments {
            let slip = s.momentum - ray.direction;
            assert!(slip.x.abs() < 1e-13 && slip.y.abs() < 1e-13, "tangential slip {slip:?}");
        }
        // sin θ₁ = n sin θ₂; the energy error of the step is the only other term.
        let d = inside.momentum.normalized();
        let sine = d.x.hypot(d.y);
        assert!((angle.sin() - 1.5 * sine).abs() < 2e-4, "{angle}: {sine}");
        assert!((path.exit.direction - ray.direction).length() < 1e-4, "parallel faces do not turn rays");
    }
}

#[test]
fn total_internal_reflection_begins_at_the_critical_angle() {
    let (medium, domain) = (slab(), domain());
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5));
    let is_reflected = |angle: f64| {
        let direction = vec3(angle.sin(), 0.0, angle.cos());
        let path = tracer.trace(&Ray { origin: vec3(-2.8, 0.0, 0.1), direction });
        // Just beyond the critical angle a ray skims along the face; farther on it is mirrored.
        if angle > 0.8 {
            let back = path.segments.iter().find(|s| s.momentum.z < 0.0 && s.start.z < 0.1).unwrap();
            let d = back.momentum.normalized();
            assert!((d - vec3(direction.x, 0.0, -direction.z)).length() < 1e-3, "{d:?}");
        }
        path.segments.iter().any(|s| s.momentum.z < 0.0)
    };
    let (mut passes, mut reflects) = (0.6_f64, 0.9_f64);
    assert!(is_reflected(reflects) && !is_reflected(passes));
    for _ in 0..12 {
        let middle = 0.5 * (passes + reflects);
        *(if is_reflected(middle) { &mut reflects } else { &mut passes }) = middle;
    }
    let critical = (1.0_f64 / 1.5).asin();
    assert!(
        (passes - critical).to_degrees().abs() < 0.02,
        "{} vs {}",
        passes.to_degrees(),
        critical.to_degrees()
    );
}

#[test]
fn rays_that_leave_and_enter_again_pass_every_region() {
    // Three thin prisms in a row, the middle one touching the first, and one off the way.
    let prism = |center: Vec3<f64>| {
        let bounds = Aabb::cube_at(center, 0.3);
        let n = move |x: Vec3<f64>| 1.0 + 0.3 * ramp((x - center).length() - 0.12, 0.03);
        IndexGrid::from_samples(bounds, [25; 3], Interpolation::CubicBSpline, n)
    };
    let centers = [vec3(-0.6, 0.05, 0.0), vec3(0.0, 0.03, 0.02), vec3(1.1, 0.0, 0.0), vec3(0.5, 1.0, 0.0)];
    let medium = Medium::new(centers.map(prism).to_vec()).unwrap();
    let domain = domain();
    let ray = Ray { origin: vec3(-2.5, 0.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
    let path = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5)).trace(&ray);
    let mut visited: Vec<u16> = path.steps.iter().filter(|s| s.lattice > 0).map(|s| s.region).collect();
    visited.dedup();
    assert_eq!((visited, path.end), (vec![0, 1, 2], PathEnd::Escaped));
    for pair in path.segments.windows(2).zip(&path.steps) {
        let ([a, b], step) = (pair.0, pair.1) else { unreachable!() };
        assert!((a.at(step.drift) - b.start).length() < 1e-12, "segments join");
    }
}

#[test]
fn a_path_with_too_many_segments_says_so() {
    let (medium, domain) = (slab(), domain());
    let short = Options { max_segments: 9, ..options(Integrator::Leapfrog, 0.5) };
    let path = Tracer::new(&medium, &domain, short).trace(&from_above(0.3));
    assert_eq!((path.end, path.segments.len()), (PathEnd::Exhausted, 9));
}

#[test]
fn a_ray_through_vacuum_is_one_segment_clipped_by_the_domain() {
    let (medium, domain) = (slab(), domain());
    let options = Options { near: 0.25, ..options(Integrator::Leapfrog, 0.5) };
    let tracer = Tracer::new(&medium, &domain, options);
    let path = tracer.trace(&Ray { origin: vec3(-2.0, 2.5, 0.0), direction: vec3(1.0, 0.0, 0.0) });
    assert_eq!(path.segments.len(), 1);
    assert_eq!(path.segments[0].range, [0.25, 5.0]);
    assert_eq!(path.exit.origin, vec3(3.0, 2.5, 0.0));
    let away = tracer.trace(&Ray { origin: vec3(-4.0, 2.5, 0.0), direction: vec3(-1.0, 0.0, 0.0) });
    assert_eq!(away.segments[0].range, [0.0, 0.0]);
}
