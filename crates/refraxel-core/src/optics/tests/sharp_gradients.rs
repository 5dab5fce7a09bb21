//! The adjoint of paths with events against central differences.

use super::scene::{domain, options};
use crate::index::tests::Sequence;
use crate::index::{LevelSet, MediumGradient};
use crate::optics::{
    EventKind, GRAZING, Integrator, Options, PartialReflectionAdjoint, Path, PathAdjoint, RayAdjoint, Tracer,
};
use crate::segment::SegmentAdjoint;
use crate::{Aabb, Domain, IndexGrid, Interpolation, Medium, Ray, Vec3, vec3};

/// Central differences in f64 with step 1e-6 of O(1) quantities: truncation 1e-10, rounding 1e-10 of each evaluation.
const STEP: f64 = 1e-6;
const TOLERANCE: f64 = 1e-7;

/// A lumpy body of one index or with a field of its own.
pub(super) fn scene(seed: u64, graded: bool) -> Medium<f64> {
    let mut r = Sequence(seed);
    let lumps: Vec<(Vec3<f64>, f64)> = (0..4).map(|_| (r.vector() * 0.3, 0.25 + 0.1 * r.next())).collect();
    let phi = |x: Vec3<f64>| {
        let sum: f64 = lumps.iter().map(|(c, s)| (-(x - *c).dot(x - *c) / (2.0 * s * s)).exp()).sum();
        0.25 * (0.6 - sum)
    };
    let level = LevelSet::from_samples(Aabb::cube(1.0), [24, 26, 25], phi);
    let grid = if graded {
        let n = |x: Vec3<f64>| 1.6 + 0.2 * (3.0 * x.x).sin() * (2.0 * x.y + 1.0).cos() + 0.1 * x.z;
        IndexGrid::sharp_from_samples(level, [14, 15, 16], Interpolation::CubicBSpline, n)
    } else {
        IndexGrid::sharp(level, 1.7)
    };
    Medium::new(vec![grid]).unwrap()
}

/// A linear functional of a path: its segments and its exit ray times these coefficients.
pub(super) struct Functional {
    pub segments: Vec<SegmentAdjoint<f64>>,
    pub exit: RayAdjoint<f64>,
}

impl Functional {
    pub fn random(path: &Path<f64>, r: &mut Sequence) -> Self {
        let mut segment = || SegmentAdjoint { start: r.vector(), momentum: r.vector(), end: r.next() };
        let segments = path.segments.iter().map(|_| segment()).collect();
        Self { segments, exit: RayAdjoint { origin: r.vector(), direction: r.vector() } }
    }
    pub fn of(&self, path: &Path<f64>) -> f64 {
        let along: f64 = (path.segments.iter().zip(&self.segments))
            .map(|(s, d)| s.start.dot(d.start) + s.momentum.dot(d.momentum))
            .sum();
        let ends: f64 = path.steps.iter().zip(&self.segments).map(|(s, d)| s.drift * d.end).sum();
        ends + along + path.exit.origin.dot(self.exit.origin) + path.exit.direction.dot(self.exit.direction)
    }
    /// Its gradient by the path, with that of a functional of partial reflections.
    pub fn adjoint<'a>(&'a self, reflections: &'a [PartialReflectionAdjoint<f64>]) -> PathAdjoint<'a, f64> {
        PathAdjoint { segments: &self.segments, reflections, exit: self.exit }
    }
}

pub(super) fn tracer<'a>(medium: &'a Medium<f64>, domain: &'a Domain<f64>) -> Tracer<'a, f64> {
    Tracer::new(medium, domain, options(Integrator::Leapfrog, 0.5))
}

/// Sine of the smallest angle between ray and surface at the events of a path, on either side.
fn least_sine(medium: &Medium<f64>, path: &Path<f64>) -> f64 {
    let mut least = 1.0_f64;
    for (i, step) in path.steps.iter().enumerate().filter(|(_, s)| s.event.is_some()) {
        let level = medium.regions()[usize::from(step.region)].level_set().unwrap();
        let normal = level.sample(path.segments[i].at(step.drift)).1.normalized();
        for s in &path.segments[i..=i + 1] {
            least = least.min(s.momentum.normalized().dot(normal).abs());
        }
    }
    least
}

/// Rays through a scene from outside and inside whose events are not grazing.
pub(super) fn rays(medium: &Medium<f64>, count: usize) -> Vec<(Ray<f64>, Path<f64>)> {
    let (mut r, domain) = (Sequence(4), domain());
    let all = std::iter::from_fn(move || {
        let target = r.vector() * 0.3;
        let origin = if r.next() > 0.0 { r.vector().normalized() * 1.9 } else { r.vector() * 0.3 };
        Some(Ray { origin, direction: (target - origin).normalized() })
    });
    all.take(60 * count)
        .filter_map(|ray| {
            let path = tracer(medium, &domain).trace(&ray);
            let events = path.events().count();
            (events > 0 && events <= 6 && least_sine(medium, &path) > 0.2).then_some((ray, path))
        })
        .take(count)
        .collect()
}

fn gradient(
    medium: &Medium<f64>,
    ray: &Ray<f64>,
    path: &Path<f64>,
    f: &Functional,
) -> (MediumGradient<f64>, RayAdjoint<f64>) {
    let mut grad = medium.zero_gradient();
    let d_ray = tracer(medium, &domain()).vjp(ray, path, &f.adjoint(&[]), &mut grad);
    (grad, d_ray)
}

/// Coefficient j of the level set (0) or the field (1) of a region.
fn coefficient(medium: &mut Medium<f64>, [region, which, j]: [usize; 3]) -> &mut f64 {
    let grid = medium.region_mut(region);
    if which == 0 {
        &mut grid.level_set_mut().unwrap().coefficients_mut()[j]
    } else {
        &mut grid.coefficients_mut()[j]
    }
}

/// Central differences of a functional of a medium and a ray by a few coefficients and by the ray; returns the largest error of
/// its gradient relative to the largest derivative of its kind: level sets, indices, ray.
pub(super) fn errors(
    medium: &mut Medium<f64>,
    ray: &Ray<f64>,
    grad: &MediumGradient<f64>,
    d_ray: &RayAdjoint<f64>,
    of: impl Fn(&Medium<f64>, &Ray<f64>) -> f64,
) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    let surfaces = grad.level_set.iter().enumerate().map(|(region, g)| ([region, 0], g));
    let fields = grad.index.iter().enumerate().map(|(region, g)| ([region, 1], g));
    for ([region, which], exact) in surfaces.chain(fields) {
        let size = exact.iter().fold(1e-3_f64, |m, v| m.max(v.abs()));
        let touched: Vec<usize> = (0..exact.len()).filter(|&j| exact[j].abs() > 1e-3 * size).collect();
        for &j in touched.iter().step_by(1 + touched.len() / 40) {
            let before = *coefficient(medium, [region, which, j]);
            let mut value = |e: f64| {
                *coefficient(medium, [region, which, j]) = before + e;
                let v = of(medium, ray);
                *coefficient(medium, [region, which, j]) = before;
                v
            };
            let fd = (value(STEP) - value(-STEP)) / (2.0 * STEP);
            worst[which] = worst[which].max((fd - exact[j]).abs() / size);
        }
    }
    let exact = [d_ray.origin.to_array(), d_ray.direction.to_array()].concat();
    let size = exact.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (axis, exact) in exact.into_iter().enumerate() {
        let value = |e: f64| {
            let mut r = *ray;
            *(if axis < 3 { &mut r.origin[axis] } else { &mut r.direction[axis - 3] }) += e;
            of(medium, &r)
        };
        let fd = (value(STEP) - value(-STEP)) / (2.0 * STEP);
        worst[2] = worst[2].max((fd - exact).abs() / size);
    }
    worst
}

/// [`errors`] of a functional of replayed paths.
pub(super) fn path_errors(
    medium: &mut Medium<f64>,
    ray: &Ray<f64>,
    path: &Path<f64>,
    f: &Functional,
) -> [f64; 3] {
    let ((grad, d_ray), domain) = (gradient(medium, ray, path, f), domain());
    errors(medium, ray, &grad, &d_ray, |medium, ray| f.of(&tracer(medium, &domain).replay(ray, path)))
}

fn gradients_match(graded: bool) {
    let (mut events, mut reflections, mut most) = (0, 0, 0);
    for seed in 1..8 {
        let mut medium = scene(seed, graded);
        let mut r = Sequence(seed + 100);
        for (ray, path) in rays(&medium, 12) {
            let found: Vec<_> = path.events().collect();
            events += found.len();
            most = most.max(found.len());
            reflections += found.iter().filter(|e| e.kind == EventKind::Reflection).count();
            let worst = path_errors(&mut medium, &ray, &path, &Functional::random(&path, &mut r));
            assert!(worst.iter().all(|e| *e < TOLERANCE), "level set, index, ray: {worst:?} {found:?}");
        }
    }
    assert!(events > 130 && reflections > 15 && most >= 4, "{events}, {reflections}, {most}");
}

#[test]
fn gradients_of_paths_with_events_match_central_differences() {
    gradients_match(false);
}

#[test]
fn gradients_of_graded_bodies_match_central_differences() {
    gradients_match(true);
}

#[test]
fn derivatives_of_replayed_paths_are_those_of_traced_ones() {
    // Crossings are found again: of a body of one index nothing is held fixed but the end of the last segment.
    let (mut medium, domain) = (scene(2, false), domain());
    let mut r = Sequence(6);
    for (ray, path) in rays(&medium, 8) {
        let mut f = Functional::random(&path, &mut r);
        f.segments.fill(SegmentAdjoint::default());
        f.exit.origin = Vec3::zero();
        let (grad, d_ray) = gradient(&medium, &ray, &path, &f);
        let (u, v) = (r.vector(), r.vector());
        let along =
            |e: f64| Ray { origin: ray.origin + u * e, direction: (ray.direction + v * e).normalized() };
        let traced = |medium: &Medium<f64>, ray: &Ray<f64>| f.of(&tracer(medium, &domain).trace(ray));
        let fd = (traced(&medium, &along(STEP)) - traced(&medium, &along(-STEP))) / (2.0 * STEP);
        let v = v - ray.direction * ray.direction.dot(v);
        let exact = d_ray.origin.dot(u) + d_ray.direction.dot(v);
        assert!((fd - exact).abs() < 1e-6 * (d_ray.origin.length() + 1.0), "{fd} vs {exact}");
        // dw = n dn
        let n = medium.regions()[0].interior_index().unwrap();
        let exact = n * grad.index[0].iter().sum::<f64>();
        let mut by_index = |e: f64| {
            medium.region_mut(0).set_interior_index(n + e);
            traced(&medium, &ray)
        };
        let fd = (by_index(STEP) - by_index(-STEP)) / (2.0 * STEP);
        by_index(0.0);
        assert!((fd - exact).abs() < 1e-6 * (exact.abs() + 1.0), "{fd} vs {exact}");
    }
}

#[test]
fn derivatives_by_radius_and_index_of_a_ball_are_those_of_snells_law() {
    let (radius, n) = (0.6, 1.5);
    let ball = |r: f64| LevelSet::from_samples(Aabb::cube(1.0), [48; 3], |x: Vec3<f64>| x.length() - r);
    let e = 1e-5;
    let by_radius: Vec<f64> = (ball(radius + e).coefficients().iter().zip(ball(radius - e).coefficients()))
        .map(|(a, b)| (a - b) / (2.0 * e))
        .collect();
    let medium = Medium::new(vec![IndexGrid::sharp(ball(radius), n)]).unwrap();
    let mut r = Sequence(3);
    for i in 0..100 {
        let d = r.vector().normalized();
        let u = d.cross(r.vector()).normalized();
        let b = radius * (0.05 + 0.009 * f64::from(i));
        let ray = Ray { origin: u * b - d * 1.5, direction: d };
        let path = tracer(&medium, &domain()).trace(&ray);
        let exit = path.exit.direction;
        let (across, ahead) = (-exit.dot(u), exit.dot(d));
        let f = Functional {
            segments: vec![SegmentAdjoint::default(); path.segments.len()],
            exit: RayAdjoint {
                origin: Vec3::zero(),
                direction: (d * -across - u * ahead) / (across * across + ahead * ahead),
            },
        };
        let (grad, _) = gradient(&medium, &ray, &path, &f);
        let (root, inner) = ((1.0 - (b / radius).powi(2)).sqrt(), (1.0 - (b / (n * radius)).powi(2)).sqrt());
        let exact_index = 2.0 * b / (n * n * radius) / inner;
        let exact_radius = 2.0 * b / (radius * radius) * ((n * inner).recip() - root.recip());
        let found_index = n * grad.index[0].iter().sum::<f64>();
        let found_radius: f64 = grad.level_set[0].iter().zip(&by_radius).map(|(a, b)| a * b).sum();
        assert!((found_index / exact_index - 1.0).abs() < 5e-3, "d/dn {found_index} vs {exact_index}");
        assert!((found_radius / exact_radius - 1.0).abs() < 0.02, "d/dR {found_radius} vs {exact_radius}");
    }
}

#[test]
fn gradients_stay_bounded_at_grazing_incidence() {
    let ball = LevelSet::from_samples(Aabb::cube(1.0), [48; 3], |x: Vec3<f64>| x.length() - 0.6);
    let medium = Medium::new(vec![IndexGrid::sharp(ball, 1.5)]).unwrap();
    let largest = |b: f64| {
        let ray = Ray { origin: vec3(-1.5, b, 0.0), direction: vec3(1.0, 0.0, 0.0) };
        let path = tracer(&medium, &domain()).trace(&ray);
        assert_eq!(path.segments.len(), 3);
        let mut f = Functional::random(&path, &mut Sequence(8));
        f.segments.fill(SegmentAdjoint::default());
        let (grad, d_ray) = gradient(&medium, &ray, &path, &f);
        grad.level_set[0].iter().fold(d_ray.origin.length(), |m, v| m.max(v.abs()))
    };
    // cos of the angle of incidence: 0.05 at b = 0.99875 R, 0.014 at 0.9999 R.
    let (at_bound, beyond) = (largest(0.6 * (1.0 - 0.5 * GRAZING * GRAZING)), largest(0.6 * 0.9999));
    assert!(beyond < 2.0 * at_bound, "{beyond} against {at_bound}");
}

#[test]
fn exhausted_paths_that_end_with_an_event_have_their_adjoint() {
    let mut medium = scene(3, true);
    let from_outside = |p: &Path<f64>| p.steps[0].event.is_some_and(|e| !e.from_inside);
    let (ray, _) = rays(&medium, 9).into_iter().find(|(_, p)| from_outside(p)).unwrap();
    let domain = domain();
    let o = Options { max_segments: 1, ..options(Integrator::Leapfrog, 0.5) };
    let path = Tracer::new(&medium, &domain, o).trace(&ray);
    assert!(path.segments.len() == 1 && path.steps[0].event.is_some());
    let f = Functional::random(&path, &mut Sequence(5));
    let worst = path_errors(&mut medium, &ray, &path, &f);
    assert!(worst.iter().all(|e| *e < TOLERANCE), "{worst:?}");
}

#[test]
fn single_precision_gradients_agree_with_double() {
    let medium = scene(2, true);
    let (single, small) = (medium.cast::<f32>(), domain().cast::<f32>());
    let fast = Tracer::new(&single, &small, Options { step: 0.5, ..Options::default() });
    let (mut r, mut sum, mut sum32) = (Sequence(1), medium.zero_gradient(), single.zero_gradient());
    for (ray, path) in rays(&medium, 20) {
        let path32 = fast.trace(&ray.cast());
        assert_eq!(path32.segments.len(), path.segments.len());
        let f = Functional::random(&path, &mut r);
        tracer(&medium, &domain()).vjp(&ray, &path, &f.adjoint(&[]), &mut sum);
        let single = |d: &SegmentAdjoint<f64>| SegmentAdjoint {
            start: d.start.cast::<f32>(),
            momentum: d.momentum.cast(),
            end: d.end as f32,
        };
        let segments: Vec<_> = f.segments.iter().map(single).collect();
        let exit = RayAdjoint { origin: f.exit.origin.cast(), direction: f.exit.direction.cast() };
        let d = PathAdjoint { segments: &segments, reflections: &[], exit };
        fast.vjp(&ray.cast(), &path32, &d, &mut sum32);
    }
    for (a, b) in [(&sum.index[0], &sum32.index[0]), (&sum.level_set[0], &sum32.level_set[0])] {
        let size = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let worst = a.iter().zip(b).fold(0.0_f64, |m, (a, b)| m.max((a - f64::from(*b)).abs()));
        assert!(worst < 1e-3 * size, "{}", worst / size);
    }
}
