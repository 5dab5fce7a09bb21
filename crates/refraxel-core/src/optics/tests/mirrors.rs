//! What surfaces mirror: closed forms, and the adjoint against central differences.

use super::scene::{domain, medium, options, ramp};
use super::sharp_gradients::{Functional, errors, rays, scene, tracer};
use crate::index::LevelSet;
use crate::index::tests::Sequence;
use crate::optics::{Integrator, PartialReflection, PartialReflectionAdjoint, Path, Tracer};
use crate::{Aabb, IndexGrid, Interpolation, Medium, Ray, Vec3, vec3};

/// Central differences in f64 as for paths, with one more division by a sine.
const TOLERANCE: f64 = 1e-6;

pub(super) fn mirrors(tracer: &Tracer<f64>, path: &Path<f64>) -> Vec<PartialReflection<f64>> {
    let mut out = Vec::new();
    tracer.partial_reflections(path, &mut out);
    out
}

#[test]
fn a_slab_transmits_one_minus_r_squared_and_mirrors_back() {
    let level = LevelSet::from_samples(Aabb::cube(1.0), [41; 3], |x: Vec3<f64>| x.x.abs() - 0.3);
    let medium = Medium::new(vec![IndexGrid::sharp(level, 1.5)]).unwrap();
    let domain = domain();
    let through = |angle: f64| {
        let direction = vec3(angle.cos(), angle.sin(), 0.0);
        let tracer = tracer(&medium, &domain);
        mirrors(&tracer, &tracer.trace(&Ray { origin: vec3(-1.2, -0.3, 0.0), direction }))
    };
    let [front, back] = &through(0.0)[..] else { panic!("two faces") };
    assert!((front.reflectance - 0.04).abs() < 1e-9 && (back.reflectance - 0.04).abs() < 1e-9);
    let transmitted = (1.0 - front.reflectance) * (1.0 - back.reflectance);
    // All orders between the faces together: (1 − R)/(1 + R).
    assert!((transmitted - 0.9216).abs() < 1e-8 && (transmitted - 0.96 / 1.04).abs() < 0.002);
    assert!(!front.from_inside && back.from_inside && front.segment == 0 && back.segment == 1);
    let [front, back] = &through(0.6)[..] else { panic!("two faces") };
    assert!((front.reflectance - back.reflectance).abs() < 1e-9, "parallel faces mirror alike");
    assert!((front.direction - vec3(-0.6_f64.cos(), 0.6_f64.sin(), 0.0)).length() < 1e-9);
    assert!((front.position.x + 0.3).abs() < 1e-9 && (back.position.x - 0.3).abs() < 1e-9);
    let inner = 0.6_f64.sin() / 1.5;
    assert!((back.direction - vec3(-(1.0 - inner * inner).sqrt(), inner, 0.0)).length() < 1e-9);
}

#[test]
fn total_reflection_is_left_to_the_path() {
    let level = LevelSet::from_samples(Aabb::cube(1.0), [41; 3], |x: Vec3<f64>| x.x.abs() - 0.3);
    let medium = Medium::new(vec![IndexGrid::sharp(level, 1.5)]).unwrap();
    let domain = domain();
    let tracer = tracer(&medium, &domain);
    // From inside, beyond the critical angle of 41.8 degrees.
    let path = tracer.trace(&Ray { origin: Vec3::zero(), direction: vec3(0.6, 0.8, 0.0) });
    assert!(path.events().any(|e| e.kind == crate::optics::EventKind::Reflection));
    let refractions = path.events().filter(|e| e.kind == crate::optics::EventKind::Refraction).count();
    assert_eq!(mirrors(&tracer, &path).len(), refractions);
}

/// A linear functional of segments, exit ray and partial reflections.
pub(super) struct Mirrored {
    pub path: Functional,
    pub reflections: Vec<PartialReflectionAdjoint<f64>>,
}

impl Mirrored {
    pub fn random(path: &Path<f64>, count: usize, r: &mut Sequence) -> Self {
        let mut one = || PartialReflectionAdjoint {
            position: r.vector(),
            direction: r.vector(),
            reflectance: 4.0 * r.next(),
        };
        let reflections = (0..count).map(|_| one()).collect();
        Self { path: Functional::random(path, r), reflections }
    }

    pub fn of(&self, tracer: &Tracer<f64>, ray: &Ray<f64>, path: &Path<f64>) -> f64 {
        let path = tracer.replay(ray, path);
        let terms = mirrors(tracer, &path).into_iter().zip(&self.reflections).map(|(m, d)| {
            m.position.dot(d.position) + m.direction.dot(d.direction) + m.reflectance * d.reflectance
        });
        self.path.of(&path) + terms.sum::<f64>()
    }
}

/// [`errors`] of a functional of replayed paths and of what their surfaces mirror.
pub(super) fn mirror_errors(
    medium: &mut Medium<f64>,
    ray: &Ray<f64>,
    path: &Path<f64>,
    f: &Mirrored,
) -> [f64; 3] {
    let domain = domain();
    let mut grad = medium.zero_gradient();
    let d_ray = tracer(medium, &domain).vjp(ray, path, &f.path.adjoint(&f.reflections), &mut grad);
    errors(medium, ray, &grad, &d_ray, |medium, ray| f.of(&tracer(medium, &domain), ray, path))
}

#[test]
fn gradients_of_what_is_mirrored_match_central_differences() {
    let mut seen = 0;
    for (seed, graded) in [(1, false), (2, true), (3, false), (4, true)] {
        let mut medium = scene(seed, graded);
        let mut r = Sequence(seed + 200);
        for (ray, path) in rays(&medium, 10) {
            let count = mirrors(&tracer(&medium, &domain()), &path).len();
            seen += count;
            let f = Mirrored::random(&path, count, &mut r);
            let worst = mirror_errors(&mut medium, &ray, &path, &f);
            assert!(worst.iter().all(|e| *e < TOLERANCE), "level set, index, ray: {worst:?}");
        }
    }
    assert!(seen > 50, "{seen}");
}

#[test]
fn the_first_adjoints_stand_for_all_where_the_rest_is_zero() {
    let medium = scene(1, true);
    let domain = domain();
    let (ray, path) = rays(&medium, 9).into_iter().find(|(_, p)| p.events().count() > 2).unwrap();
    let tracer = tracer(&medium, &domain);
    let mut f = Mirrored::random(&path, mirrors(&tracer, &path).len(), &mut Sequence(9));
    f.reflections[1..].fill(PartialReflectionAdjoint::default());
    let gradient = |reflections: &[PartialReflectionAdjoint<f64>]| {
        let mut grad = medium.zero_gradient();
        let d_ray = tracer.vjp(&ray, &path, &f.path.adjoint(reflections), &mut grad);
        (grad, d_ray)
    };
    assert_eq!(gradient(&f.reflections), gradient(&f.reflections[..1]));
}

/// A slab of n = 1.5 whose faces are `width` wide.
fn soft_slab(width: f64, nodes: u32) -> Medium<f64> {
    let n = |x: Vec3<f64>| 1.0 + 0.5 * ramp(x.x.abs() - 0.5, width);
    let bounds = Aabb::new(vec3(-1.5, -4.0, -1.0), vec3(1.5, 4.0, 1.0));
    let grid = IndexGrid::from_control_values(bounds, [nodes, 24, 16], Interpolation::CubicBSpline, n);
    Medium::new(vec![grid]).unwrap()
}

/// What entering and leaving that slab at `sine` of incidence mirrors.
fn of_slab(width: f64, nodes: u32, step: f64, sine: f64) -> Vec<PartialReflection<f64>> {
    let (medium, domain) = (soft_slab(width, nodes), domain());
    let direction = vec3((1.0 - sine * sine).sqrt(), sine, 0.0);
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, step));
    mirrors(&tracer, &tracer.trace(&Ray { origin: -direction * 1.9, direction }))
}

#[test]
fn a_smooth_transition_mirrors_one_reflectance_whatever_its_width_and_the_step() {
    for sine in [0.0_f64, 0.5, 0.8] {
        let (before, after) = ((1.0 - sine * sine).sqrt(), (2.25 - sine * sine).sqrt());
        let exact = crate::optics::fresnel::Incidence { before, after, w_before: 0.5, w_after: 1.125 };
        for (width, nodes, step) in [(0.08, 97, 0.5), (0.08, 193, 0.5), (0.04, 193, 0.5), (0.08, 97, 0.25)] {
            let [front, back] = &of_slab(width, nodes, step, sine)[..] else { panic!("two faces") };
            for found in [front, back] {
                let off = found.reflectance / exact.reflectance() - 1.0;
                assert!(off.abs() < 0.01, "{sine} {width} {nodes} {step}: {off}");
            }
            assert!(!front.from_inside && back.from_inside);
            assert!((front.position.x + 0.5).abs() < 0.03 && (back.position.x - 0.5).abs() < 0.03);
            assert!((front.normal - vec3(-1.0, 0.0, 0.0)).length() < 1e-9);
            assert!((front.direction - vec3(-before, sine, 0.0)).length() < 0.01, "{:?}", front.direction);
            let inside = vec3(-after, sine, 0.0) / 1.5;
            assert!((back.direction - inside).length() < 0.01, "{:?} {inside:?}", back.direction);
        }
    }
}

#[test]
fn a_constant_medium_and_a_lens_mirror_nothing() {
    let luneburg = |x: Vec3<f64>| (2.0 - (x.dot(x) / 0.64).min(1.0)).sqrt();
    for index in [&(|_| 1.0) as &dyn Fn(Vec3<f64>) -> f64, &luneburg] {
        let medium = medium(1.0, 48, Interpolation::CubicBSpline, index);
        let domain = domain();
        let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5));
        for impact in [0.1, 0.3, 0.5, 0.6, 0.7, 0.76] {
            let ray = Ray { origin: vec3(-1.5, impact, 0.01), direction: vec3(1.0, 0.0, 0.0) };
            assert!(mirrors(&tracer, &tracer.trace(&ray)).is_empty(), "{impact}");
        }
    }
}

#[test]
fn from_water_into_glass_light_is_mirrored_inside() {
    // A plate of glass behind water, without air between.
    let n =
        |x: Vec3<f64>| 1.0 + 0.33 * ramp(x.x.abs() - 0.6, 0.05) + 0.27 * ramp((x.x - 0.3).abs() - 0.3, 0.05);
    let bounds = Aabb::new(vec3(-1.5, -4.0, -1.0), vec3(1.5, 4.0, 1.0));
    let grid = IndexGrid::from_control_values(bounds, [97, 24, 16], Interpolation::CubicBSpline, n);
    let (medium, domain) = (Medium::new(vec![grid]).unwrap(), domain());
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5));
    let ray = Ray { origin: vec3(-1.9, 0.1, 0.0), direction: vec3(1.0, 0.0, 0.0) };
    let [water, glass, air] = &mirrors(&tracer, &tracer.trace(&ray))[..] else { panic!("three surfaces") };
    assert_eq!([water, glass, air].map(|m| m.from_inside), [false, true, true]);
    let share = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    for (found, exact) in [(water, share(1.0, 1.33)), (glass, share(1.33, 1.6)), (air, share(1.6, 1.0))] {
        assert!((found.reflectance / exact - 1.0).abs() < 0.03, "{} {exact}", found.reflectance);
        assert!((found.direction - vec3(-1.0, 0.0, 0.0)).length() < 1e-6);
    }
}

#[test]
fn total_reflection_in_a_smooth_transition_is_left_to_the_path() {
    let (medium, domain) = (soft_slab(0.08, 97), domain());
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.5));
    for sine in [0.75_f64, 0.8, 0.9] {
        // From inside, beyond the critical angle.
        let direction = vec3((1.0 - sine * sine).sqrt(), sine, 0.0);
        let path = tracer.trace(&Ray { origin: vec3(0.0, -2.5, 0.0), direction });
        assert!(path.segments.iter().any(|s| s.momentum.x < 0.0), "it turns round");
        // Far from the end of the slab.
        let found: Vec<_> =
            mirrors(&tracer, &path).into_iter().filter(|m| m.position.y.abs() < 2.0).collect();
        assert!(found.is_empty(), "{sine}: {found:?}");
    }
}

#[test]
fn gradients_of_what_smooth_transitions_mirror_match_central_differences() {
    let mut seen = 0;
    for seed in 1..4 {
        let mut r = Sequence(seed);
        let (axes, tilt) = (vec3(1.0 + 0.2 * r.next(), 1.0 + 0.2 * r.next(), 1.0), r.vector() * 0.05);
        let n =
            |x: Vec3<f64>| 1.0 + (0.6 + tilt.dot(x)) * ramp(x.zip(axes, |a, b| a * b).length() - 0.55, 0.09);
        let mut medium = medium(1.0, 36, Interpolation::CubicBSpline, n);
        for _ in 0..6 {
            let origin = r.vector().normalized() * 1.8;
            let ray = Ray { origin, direction: (r.vector() * 0.25 - origin).normalized() };
            let path = tracer(&medium, &domain()).trace(&ray);
            let count = mirrors(&tracer(&medium, &domain()), &path).len();
            seen += count;
            let f = Mirrored::random(&path, count, &mut r);
            let worst = mirror_errors(&mut medium, &ray, &path, &f);
            assert!(worst.iter().all(|e| *e < TOLERANCE), "index, ray: {worst:?}");
        }
    }
    assert!(seen > 30, "{seen}");
}

/// A soft ball beside a sharp one.
fn mixed() -> Medium<f64> {
    let soft = Aabb::new(vec3(0.05, -0.5, -0.5), vec3(1.05, 0.5, 0.5));
    let n = |x: Vec3<f64>| 1.0 + 0.5 * ramp((x - vec3(0.55, 0.0, 0.0)).length() - 0.3, 0.04);
    let soft = IndexGrid::from_control_values(soft, [36; 3], Interpolation::CubicBSpline, n);
    let sharp = Aabb::new(vec3(-1.05, -0.5, -0.5), vec3(-0.05, 0.5, 0.5));
    let sharp =
        LevelSet::from_samples(sharp, [24; 3], |x: Vec3<f64>| (x - vec3(-0.55, 0.0, 0.0)).length() - 0.3);
    Medium::new(vec![soft, IndexGrid::sharp(sharp, 1.5)]).unwrap()
}

#[test]
fn sharp_and_smooth_surfaces_mirror_on_one_path() {
    let (mut medium, domain) = (mixed(), domain());
    let mut r = Sequence(8);
    for (origin, y) in [(-1.9, 0.06), (1.9, -0.05), (-1.9, 0.02)] {
        let direction = vec3(-f64::signum(origin), 0.01, 0.02).normalized();
        let ray = Ray { origin: vec3(origin, y, 0.03), direction };
        let path = tracer(&medium, &domain).trace(&ray);
        let found = mirrors(&tracer(&medium, &domain), &path);
        assert_eq!(found.len(), 4, "{found:?}");
        assert!(found.is_sorted_by_key(|m| m.segment));
        assert_eq!(found.iter().map(|m| m.from_inside).collect::<Vec<_>>(), [false, true, false, true]);
        let f = Mirrored::random(&path, 4, &mut r);
        let [_, index, by_ray] = mirror_errors(&mut medium, &ray, &path, &f);
        assert!(index < TOLERANCE && by_ray < TOLERANCE, "{index} {by_ray}");
    }
}

#[test]
#[should_panic(expected = "no more adjoints than partial reflections")]
fn more_adjoints_than_reflections_are_a_mistake() {
    let (medium, domain) = (mixed(), domain());
    let tracer = tracer(&medium, &domain);
    let ray = Ray { origin: vec3(-1.9, 0.06, 0.03), direction: vec3(1.0, 0.01, 0.02).normalized() };
    let path = tracer.trace(&ray);
    let f = Mirrored::random(&path, 5, &mut Sequence(3));
    tracer.vjp(&ray, &path, &f.path.adjoint(&f.reflections), &mut medium.zero_gradient());
}
