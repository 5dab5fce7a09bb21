//! Bodies in bodies against the closed forms of Snell's law, and that no path loses count of where it is.

use super::measures::median_and_largest;
use super::mirrors::mirrors;
use super::scene::{domain, options};
use super::sharp::{Impact, impacts, kinds, trace};
use crate::index::LevelSet;
use crate::index::tests::Sequence;
use crate::optics::{EventKind, Integrator, Options, Path, PathEnd, Tracer};
use crate::{Aabb, IndexGrid, Interpolation, Medium, Ray, Vec3, vec3};

/// A body in the cube [−half, half]³.
fn body(half: f64, nodes: u32, index: f64, phi: impl Fn(Vec3<f64>) -> f64) -> IndexGrid<f64> {
    IndexGrid::sharp(LevelSet::from_samples(Aabb::cube(half), [nodes; 3], phi), index)
}

fn ball(half: f64, nodes: u32, index: f64, radius: f64) -> IndexGrid<f64> {
    body(half, nodes, index, |x| x.length() - radius)
}

/// A body |z − middle| < thickness/2. Control values: linear coefficients are an exact plane.
fn plate(middle: f64, thickness: f64, index: f64) -> IndexGrid<f64> {
    let phi = |x: Vec3<f64>| (x.z - middle).abs() - 0.5 * thickness;
    IndexGrid::sharp(LevelSet::from_control_values(Aabb::cube(2.5), [76; 3], phi), index)
}

/// The media along a path.
fn media(path: &Path<f64>) -> Vec<Option<u16>> {
    path.steps.iter().map(|s| s.within).collect()
}

/// Asserts that a path is in the medium that rules at the middle of each of its segments, and ends.
fn assert_no_leak(medium: &Medium<f64>, path: &Path<f64>) {
    assert_eq!(path.end, PathEnd::Escaped, "{path:?}");
    for (step, segment) in path.steps.iter().zip(&path.segments) {
        let length = step.drift * segment.momentum.length();
        // Between surfaces that coincide but for rounding nothing can be said.
        if length > 1e-6 {
            let middle = segment.at(0.5 * step.drift);
            let n = medium.index(middle);
            assert!((segment.momentum.length() - n).abs() < 1e-9, "{n} at {middle:?}, {segment:?}");
            assert_eq!(step.within.map(usize::from), medium.ruling_at(middle));
        }
    }
}

#[test]
fn the_sine_of_the_angle_times_the_index_is_the_same_in_plates_within_plates() {
    let medium =
        Medium::new(vec![plate(0.0, 1.8, 1.5), plate(0.0, 1.0, 1.33), plate(0.1, 0.4, 1.8)]).unwrap();
    for k in 0..60 {
        let angle = 0.0225 * f64::from(k);
        let direction = vec3(angle.sin() * 0.8, angle.sin() * 0.6, angle.cos());
        let start = vec3(0.0, 0.0, -0.95);
        let path = trace(&medium, &Ray { origin: start, direction });
        assert_eq!(media(&path), [None, Some(0), Some(1), Some(2), Some(1), Some(0), None]);
        for (segment, n) in path.segments.iter().zip([1.0, 1.5, 1.33, 1.8, 1.33, 1.5, 1.0]) {
            let p = segment.momentum;
            assert!((p.length() - n).abs() < 1e-14);
            assert!((p.x.hypot(p.y) - angle.sin()).abs() < 1e-14, "n sin(angle) at {n}");
        }
        assert!((path.exit.direction - direction).length() < 1e-13);
        // The offset: thickness times tangent, layer by layer.
        let tangent = |n: f64| (angle.sin() / n) / (1.0 - (angle.sin() / n).powi(2)).sqrt();
        let aside = 0.05 * tangent(1.0) + 0.8 * tangent(1.5) + 0.6 * tangent(1.33) + 0.4 * tangent(1.8);
        let x = path.segments[6].start;
        assert!((x.x.hypot(x.y) - aside).abs() < 1e-12 && (x.z - 0.9).abs() < 1e-13);
    }
}

#[test]
fn a_bubble_in_glass_refracts_as_a_shell_of_one_level_set() {
    let (outer, inner, n) = (0.8, 0.5, 1.5);
    let bubble = Medium::new(vec![ball(1.0, 64, n, outer), ball(0.7, 48, 1.0, inner)]).unwrap();
    let (middle, half) = (0.65, 0.15);
    // Not the distance: that has a kink in the middle of the shell.
    let shell = body(1.0, 64, n, |x| ((x.length() - middle).powi(2) - half * half) / (2.0 * half));
    let shell = Medium::new(vec![shell]).unwrap();
    for Impact { ray, aside: u, b } in impacts([0.05, 0.1, 0.3, 0.45, 0.52, 0.6, 0.72, 0.77]) {
        let (path, other) = (trace(&bubble, &ray), trace(&shell, &ray));
        assert_eq!(kinds(&path), kinds(&other));
        assert!((path.exit.direction - other.exit.direction).length() < 2e-3);
        // Bouguer: n r sin(angle) = b on every sphere; inside the bubble a ray is as straight as outside.
        let mut turn = 2.0 * ((b / outer).asin() - (b / (n * outer)).asin());
        let mut events = 2;
        if b < inner {
            turn -= 2.0 * ((b / inner).asin() - (b / (n * inner)).asin());
            events = 4;
        } else if b < n * inner {
            turn -= std::f64::consts::PI - 2.0 * (b / (n * inner)).asin();
            events = 3;
        }
        assert_eq!(kinds(&path).len(), events, "impact {b}");
        let exact = ray.direction * turn.cos() - u * turn.sin();
        let off = (path.exit.direction - exact).length();
        assert!(off < 2e-4, "impact {b}: {off}");
        assert_no_leak(&bubble, &path);
    }
}

#[test]
fn a_camera_in_water_behind_a_flat_port_sees_by_snells_law() {
    // The water reaches into the port, which is later in the list and rules there.
    let water = body(2.5, 76, 1.33, |x: Vec3<f64>| (x.z + 0.15).max(-1.6 - x.z));
    let medium = Medium::new(vec![water, plate(-0.1, 0.2, 1.5)]).unwrap();
    for k in 0..40 {
        let angle = 0.018 * f64::from(k);
        let origin = vec3(0.1, -0.2, -0.6);
        let path = trace(&medium, &Ray { origin, direction: vec3(angle.sin(), 0.0, angle.cos()) });
        assert_eq!(media(&path), [Some(0), Some(1), None]);
        let sine = 1.33 * angle.sin();
        assert!((path.exit.direction.x - sine).abs() < 1e-13 && path.exit.direction.y.abs() < 1e-13);
        let tangent = |n: f64| (sine / n) / (1.0 - (sine / n).powi(2)).sqrt();
        let x = path.segments[2].start;
        assert!((x.x - 0.1 - 0.4 * tangent(1.33) - 0.2 * tangent(1.5)).abs() < 1e-12 && x.z.abs() < 1e-13);
    }
}

#[test]
fn total_reflection_at_an_inner_interface_begins_at_its_critical_angle_and_stays_in_its_medium() {
    let medium = Medium::new(vec![plate(0.0, 1.8, 1.7), plate(0.0, 0.4, 1.2)]).unwrap();
    let critical = (1.2_f64 / 1.7).asin();
    for (off, kind) in [(-1e-9, EventKind::Refraction), (1e-9, EventKind::Reflection)] {
        let angle = critical + off;
        let direction = vec3(angle.sin(), 0.0, angle.cos());
        let path = trace(&medium, &Ray { origin: vec3(-0.3, 0.0, -0.5), direction });
        assert_eq!(kinds(&path)[0], kind);
        assert_eq!(path.steps[0].region, 1);
        assert_eq!(path.steps[1].within, Some(if kind == EventKind::Reflection { 0 } else { 1 }));
        if kind == EventKind::Reflection {
            let mirrored = vec3(angle.sin(), 0.0, -angle.cos()) * 1.7;
            assert!((path.segments[1].momentum - mirrored).length() < 1e-13);
        }
    }
}

#[test]
fn what_an_inner_interface_mirrors_and_transmits_is_all_of_the_light() {
    let medium = Medium::new(vec![plate(0.0, 1.8, 1.5), plate(0.0, 1.0, 1.33)]).unwrap();
    let domain = domain();
    let tracer = Tracer::new(&medium, &domain, Options::default());
    for k in 0..50 {
        let angle = 0.028 * f64::from(k);
        let direction = vec3(0.6 * angle.sin(), 0.8 * angle.sin(), angle.cos());
        let path = tracer.trace(&Ray { origin: vec3(0.0, 0.0, -0.95), direction });
        let found = mirrors(&tracer, &path);
        assert_eq!(found.iter().map(|m| m.within).collect::<Vec<_>>(), [None, Some(0), Some(1), Some(0)]);
        assert_eq!(found.iter().map(|m| m.region).collect::<Vec<_>>(), [0, 1, 1, 0]);
        assert_eq!(found.iter().map(|m| m.from_inside).collect::<Vec<_>>(), [false, false, true, true]);
        for m in &found {
            // Transmitted power by the transmitted amplitudes of both polarisations.
            let [p, q] = [m.segment, m.segment + 1].map(|i| path.segments[i].momentum);
            let (a, s) = (p.dot(m.normal).abs(), q.dot(m.normal).abs());
            let (n1, n2) = (p.length(), q.length());
            let (t_s, t_p) = (2.0 * a / (a + s), 2.0 * a * n1 * n2 / (n2 * n2 * a + n1 * n1 * s));
            let transmitted = 0.5 * (s / a) * (t_s * t_s + t_p * t_p);
            assert!((m.reflectance + transmitted - 1.0).abs() < 1e-13);
            let mirrored = p - m.normal * (2.0 * p.dot(m.normal));
            assert!((m.direction * n1 - mirrored).length() < 1e-13);
        }
        let normal_incidence = (0.17_f64 / 2.83).powi(2);
        assert!(k > 0 || (found[1].reflectance - normal_incidence).abs() < 1e-15);
    }
}

/// Lumpy glass with a bubble, and a body of 1.33 that lies partly in the glass and partly in the bubble.
fn tangle() -> Medium<f64> {
    let wavy = |x: Vec3<f64>| x.length() - 0.7 - 0.05 * (5.0 * x.x).sin() * (4.0 * x.y).cos();
    let bubble = |x: Vec3<f64>| (x - vec3(0.2, 0.1, 0.0)).length() - 0.3;
    let drop = |x: Vec3<f64>| (x - vec3(0.4, -0.2, 0.3)).length() - 0.4;
    Medium::new(vec![body(1.0, 48, 1.6, wavy), body(0.9, 48, 1.0, bubble), body(1.0, 48, 1.33, drop)])
        .unwrap()
}

/// Random rays through the middle of a scene, from outside and from inside.
fn random_rays(count: usize) -> impl Iterator<Item = Ray<f64>> {
    let mut r = Sequence(31);
    (0..count).map(move |i| {
        let target = r.vector() * 0.6;
        let origin = if i % 4 == 0 { r.vector() * 0.6 } else { r.vector().normalized() * 1.9 };
        Ray { origin, direction: (target - origin).normalized() }
    })
}

#[test]
fn the_reversed_exit_ray_returns_through_bodies_in_bodies() {
    let (medium, mut most) = (tangle(), 0);
    for ray in random_rays(400).filter(|r| r.origin.length() > 1.5) {
        let path = trace(&medium, &ray);
        if path.end == PathEnd::Exhausted || path.steps.len() > 12 {
            continue; // a ray caught by total reflections
        }
        let back = Ray { origin: path.exit.origin, direction: -path.exit.direction };
        let returned = trace(&medium, &back);
        let mut reversed = media(&returned);
        reversed.reverse();
        assert_eq!(reversed, media(&path));
        assert!((returned.exit.direction + ray.direction).length() < 1e-7);
        most = most.max(path.steps.len());
    }
    assert!(most >= 7, "{most}");
}

#[test]
fn every_segment_lies_in_the_medium_that_rules_there() {
    let medium = tangle();
    let mut seen = [0; 4];
    for ray in random_rays(2000) {
        let path = trace(&medium, &ray);
        if path.end == PathEnd::Exhausted {
            assert_eq!(
                path.steps.len(),
                Options::<f64>::default().max_segments,
                "lost, not caught: {path:?}"
            );
            continue;
        }
        assert_no_leak(&medium, &path);
        media(&path).iter().for_each(|m| seen[m.map_or(3, usize::from)] += 1);
    }
    assert!(seen.iter().all(|count| *count > 400), "{seen:?}");
}

#[test]
fn where_two_bodies_overlap_the_later_one_rules() {
    let left = || body(1.2, 48, 1.5, |x: Vec3<f64>| (x - vec3(-0.25, 0.0, 0.0)).length() - 0.5);
    let right = || body(1.2, 48, 1.33, |x: Vec3<f64>| (x - vec3(0.25, 0.0, 0.0)).length() - 0.5);
    let ray = Ray { origin: vec3(-1.5, 0.0, 0.0), direction: vec3(1.0, 0.0, 0.0) };
    for (bodies, at_change, middle) in
        [(vec![left(), right()], -0.25, 1.33), (vec![right(), left()], 0.25, 1.5)]
    {
        let medium = Medium::new(bodies).unwrap();
        let path = trace(&medium, &ray);
        assert_eq!(path.segments.len(), 4, "a surface below another is no event");
        assert!((path.segments[2].start.x - at_change).abs() < 1e-4);
        assert!((medium.index(Vec3::zero()) - middle).abs() < 1e-14);
        let momenta: Vec<f64> = path.segments.iter().map(|s| s.momentum.length()).collect();
        for (found, n) in momenta.iter().zip([1.0, 1.5, 1.33, 1.0]) {
            assert!((found - n).abs() < 1e-14);
        }
    }
}

#[test]
fn surfaces_that_touch_or_coincide_never_leak() {
    let step = |x: Vec3<f64>| (x.z.abs() - 0.5).max(x.x.abs().max(x.y.abs()) - 0.8);
    let inner = |x: Vec3<f64>| (x.z.abs() - 0.5).max(x.x.abs().max(x.y.abs()) - 0.6);
    let ball = |x: Vec3<f64>| x.length() - 0.6;
    let pairs: [[IndexGrid<f64>; 2]; 4] = [
        // The same surface twice, on the same nodes and on others.
        [body(1.0, 40, 1.5, ball), body(1.0, 40, 1.33, ball)],
        [body(1.0, 40, 1.33, ball), body(1.1, 56, 1.5, ball)],
        // Two faces in common.
        [body(1.0, 41, 1.5, step), body(1.0, 41, 1.33, inner)],
        // One touches the other from outside.
        [
            body(1.6, 65, 1.5, |x| ball(x - vec3(0.6, 0.0, 0.0))),
            body(1.6, 65, 1.33, |x| ball(x + vec3(0.6, 0.0, 0.0))),
        ],
    ];
    for pair in pairs {
        let medium = Medium::new(pair.to_vec()).unwrap();
        let domain = domain();
        let tracer = Tracer::new(&medium, &domain, Options { max_segments: 400, ..Options::default() });
        let (mut unresolved, mut met) = (0, 0);
        for ray in random_rays(2500) {
            let path = tracer.trace(&ray);
            met += usize::from(path.steps.len() > 1);
            // Light guides catch some rays that begin inside; all others must end in vacuum.
            unresolved += usize::from(path.end == PathEnd::Exhausted && path.steps.len() < 400);
            if path.end == PathEnd::Escaped {
                assert!((path.segments.last().unwrap().momentum.length() - 1.0).abs() < 1e-12);
            }
            for (step, segment) in path.steps.iter().zip(&path.segments) {
                let (middle, length) = (segment.at(0.5 * step.drift), step.drift * segment.momentum.length());
                let near = medium.regions().iter().any(|r| r.level_set().unwrap().value(middle).abs() < 1e-3);
                assert!(
                    length < 1e-3 || near || medium.ruling_at(middle) == step.within.map(usize::from),
                    "{step:?} {segment:?}"
                );
            }
        }
        assert!(unresolved == 0 && met > 1200, "{unresolved} of {met}");
    }
}

#[test]
fn a_later_copy_of_a_body_hides_the_earlier_one() {
    let medium = Medium::new(vec![ball(1.0, 40, 1.5, 0.6), ball(1.0, 40, 1.33, 0.6)]).unwrap();
    let alone = Medium::new(vec![ball(1.0, 40, 1.33, 0.6)]).unwrap();
    for ray in random_rays(1000).filter(|r| r.origin.length() > 1.5) {
        let (path, other) = (trace(&medium, &ray), trace(&alone, &ray));
        assert_eq!(kinds(&path), kinds(&other));
        assert!((path.exit.direction - other.exit.direction).length() < 1e-9);
    }
}

#[test]
fn a_body_of_the_same_index_inside_another_changes_and_mirrors_nothing() {
    let outer = || body(1.0, 48, 1.5, |x: Vec3<f64>| x.length() - 0.8);
    let medium = Medium::new(vec![outer(), ball(0.8, 32, 1.5, 0.5)]).unwrap();
    let (alone, domain) = (Medium::new(vec![outer()]).unwrap(), domain());
    let tracer = Tracer::new(&medium, &domain, Options::default());
    for ray in random_rays(400).filter(|r| r.origin.length() > 1.5) {
        let (path, other) = (trace(&medium, &ray), trace(&alone, &ray));
        assert!((path.exit.direction - other.exit.direction).length() < 1e-11);
        let inner = mirrors(&tracer, &path).into_iter().filter(|m| m.region == 1);
        assert!(inner.into_iter().all(|m| m.reflectance < 1e-25));
    }
}

#[test]
fn a_body_inside_a_graded_one_of_the_same_field_changes_nothing_in_second_order() {
    let n = |x: Vec3<f64>| 1.5 + 0.2 * x.x + 0.1 * (2.0 * x.y).sin();
    let graded = |half: f64, radius: f64| {
        let level = LevelSet::from_samples(Aabb::cube(half), [40; 3], |x: Vec3<f64>| x.length() - radius);
        IndexGrid::sharp_from_samples(level, [24; 3], Interpolation::CubicBSpline, n)
    };
    let (medium, alone) = (
        Medium::new(vec![graded(1.0, 0.8), graded(0.7, 0.5)]).unwrap(),
        Medium::new(vec![graded(1.0, 0.8)]).unwrap(),
    );
    let domain = domain();
    let largest = |step: f64| {
        let [a, b] = [&medium, &alone].map(|m| Tracer::new(m, &domain, options(Integrator::Leapfrog, step)));
        let rays = random_rays(200).filter(|r| r.origin.length() > 1.5);
        let off = rays.map(|ray| (a.trace(&ray).exit.direction - b.trace(&ray).exit.direction).length());
        median_and_largest(off.collect())[0]
    };
    // What is left at small steps is the difference of the two splines.
    let (coarse, fine) = (largest(1.0), largest(0.25));
    assert!(coarse < 1e-3 && fine < 0.1 * coarse, "{coarse} {fine}");
}

#[test]
fn in_single_precision_paths_through_nested_bodies_agree_with_double() {
    let medium = tangle();
    let (single, small) = (medium.cast::<f32>(), domain().cast::<f32>());
    let tracer = Tracer::new(&single, &small, Options::default());
    let mut off: Vec<f64> = (random_rays(2000).filter(|r| r.origin.length() > 1.5))
        .map(|ray| {
            let (a, b) = (trace(&medium, &ray), tracer.trace(&ray.cast()));
            (a.exit.direction - b.exit.direction.cast()).length()
        })
        .collect();
    off.sort_by(f64::total_cmp);
    let [median, most] = [off[off.len() / 2], off[off.len() * 98 / 100]];
    assert!(median < 5e-6 && most < 1e-3, "{median}, {most}");
}
