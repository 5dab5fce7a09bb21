//! Bodies that absorb: closed forms, and gradients through length, path and surface against central differences.

use super::scene::{domain, medium, ramp};
use super::sharp_gradients::{errors, rays, scene, tracer};
use crate::index::tests::Sequence;
use crate::optics::{Path, PathAdjoint, RayAdjoint};
use crate::radiance::{Absorption, AbsorptionAdjoint};
use crate::segment::SegmentAdjoint;
use crate::{Aabb, IndexGrid, Interpolation, LevelSet, Medium, Ray, Vec3, vec3};

/// Central differences in f64 with step 1e-6 of a sum of O(10): rounding 1e-9, of derivatives that may be as small as 1e-3.
const STEP: f64 = 1e-6;
const TOLERANCE: f64 = 1e-6;
const TINT: [f64; 3] = [0.4, 0.0, 1.3];

fn tinted(mut medium: Medium<f64>) -> Medium<f64> {
    medium.region_mut(0).set_absorption(TINT);
    medium
}

/// Colours at points of a path and behind it, and dLoss/d(what shows of them).
struct Seen {
    /// Segment, t, colour, dLoss/dcolour.
    points: Vec<(usize, f64, [f64; 3], [f64; 3])>,
    behind: [f64; 3],
    d_behind: [f64; 3],
}

impl Seen {
    fn random(path: &Path<f64>, r: &mut Sequence) -> Self {
        let vector = |r: &mut Sequence| [0; 3].map(|_| r.next());
        let colour = |v: [f64; 3]| v.map(|v| 0.55 + 0.45 * v);
        let mut points = Vec::new();
        for (segment, step) in path.steps.iter().enumerate() {
            let t = step.drift.min(1.0) * (0.5 + 0.5 * r.next());
            points.push((segment, t, colour(vector(r)), vector(r)));
        }
        Self { points, behind: colour(vector(r)), d_behind: vector(r) }
    }

    fn loss(&self, medium: &Medium<f64>, path: &Path<f64>) -> f64 {
        let absorption = Absorption::new(medium, path);
        let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| a[c] * b[c]).sum::<f64>();
        let along = self
            .points
            .iter()
            .map(|&(segment, t, colour, d)| dot(d, absorption.filter(segment, t).through(colour).colour));
        along.sum::<f64>() + dot(self.d_behind, absorption.whole().through(self.behind).colour)
    }

    /// dLoss/d(segments) and dLoss/d(coefficients of the first region).
    fn vjp(&self, medium: &Medium<f64>, path: &Path<f64>) -> (Vec<SegmentAdjoint<f64>>, [f64; 3]) {
        let absorption = Absorption::new(medium, path);
        let mut adjoint = AbsorptionAdjoint::default();
        adjoint.clear(path.segments.len());
        let of = |d: [f64; 3], by: [f64; 3]| [0, 1, 2].map(|c| d[c] * by[c]);
        for &(segment, t, colour, d) in &self.points {
            let seen = absorption.filter(segment, t).through(colour);
            adjoint.add(segment, t, of(d, seen.by_thickness));
        }
        let seen = absorption.whole().through(self.behind);
        adjoint.add_after(path.segments.len(), of(self.d_behind, seen.by_thickness));
        let mut segments = vec![SegmentAdjoint::default(); path.segments.len()];
        let mut coefficients = [0.0; 3];
        adjoint.vjp(medium, path, &mut segments, |region, d| {
            assert_eq!(region, 0);
            (0..3).for_each(|c| coefficients[c] += d[c]);
        });
        (segments, coefficients)
    }
}

/// Largest relative errors of the gradients by level set, index, ray and coefficients, over some paths.
fn worst_errors(mut medium: Medium<f64>, paths: &[(Ray<f64>, Path<f64>)]) -> [f64; 4] {
    let (mut worst, mut r, domain) = ([0.0_f64; 4], Sequence(9), domain());
    for (ray, path) in paths {
        let seen = Seen::random(path, &mut r);
        let (segments, coefficients) = seen.vjp(&medium, path);
        let mut grad = medium.zero_gradient();
        let d = PathAdjoint { segments: &segments, reflections: &[], exit: RayAdjoint::default() };
        let d_ray = tracer(&medium, &domain).vjp(ray, path, &d, &mut grad);
        let of = |medium: &Medium<f64>, ray: &Ray<f64>| {
            seen.loss(medium, &tracer(medium, &domain).replay(ray, path))
        };
        let along = errors(&mut medium, ray, &grad, &d_ray, of);
        (0..3).for_each(|k| worst[k] = worst[k].max(along[k]));
        for c in [0, 2] {
            let mut value = |e: f64| {
                let mut tint = TINT;
                tint[c] += e;
                medium.region_mut(0).set_absorption(tint);
                seen.loss(&medium, path)
            };
            let fd = (value(STEP) - value(-STEP)) / (2.0 * STEP);
            worst[3] = worst[3].max((fd - coefficients[c]).abs());
        }
        medium.region_mut(0).set_absorption(TINT);
    }
    worst
}

#[test]
fn a_chord_of_a_ball_is_its_length_in_the_ball() {
    let (radius, index) = (0.8, 1.5);
    let ball = LevelSet::from_samples(Aabb::cube(1.2), [49; 3], |x: Vec3<f64>| x.length() - radius);
    let medium = tinted(Medium::new(vec![IndexGrid::sharp(ball, index)]).unwrap());
    let domain = domain();
    for b in [0.0_f64, 0.3, 0.6] {
        let ray = Ray { origin: vec3(-2.0, b, 0.0), direction: vec3(1.0, 0.0, 0.0) };
        let path = tracer(&medium, &domain).trace(&ray);
        let within: Vec<Option<u16>> = path.steps.iter().map(|s| s.within).collect();
        assert_eq!(within, [None, Some(0), None]);
        // Snell: sin of the refracted angle is b / (n R).
        let chord = 2.0 * (radius * radius - (b / index).powi(2)).sqrt();
        let absorption = Absorption::new(&medium, &path);
        let white = absorption.whole().through([1.0; 3]).colour;
        for c in 0..3 {
            let code = 1.055 * (-TINT[c] * chord / 2.4).exp() - 0.055;
            assert!((white[c] - code).abs() < 1e-4, "{b}: {} {code}", white[c]); // the ball of the spline
        }
        let middle = absorption.filter(1, 0.5 * path.steps[1].drift).through([1.0; 3]).colour[0];
        assert!((middle - (1.055 * (-TINT[0] * chord / 4.8).exp() - 0.055)).abs() < 1e-4);
        assert_eq!(absorption.filter(0, 0.7).through([0.3; 3]).colour, [0.3; 3]);
    }
}

#[test]
fn a_soft_ball_absorbs_as_a_sharp_one_does() {
    let n = |x: Vec3<f64>| 1.0 + 0.5 * ramp(x.length() - 0.8, 0.03);
    let soft = IndexGrid::from_control_values(Aabb::cube(1.2), [81; 3], Interpolation::CubicBSpline, n);
    let medium = tinted(Medium::new(vec![soft]).unwrap());
    let domain = domain();
    let ray = Ray { origin: vec3(-2.0, 0.1, 0.0), direction: vec3(1.0, 0.0, 0.0) };
    let path = tracer(&medium, &domain).trace(&ray);
    let white = Absorption::new(&medium, &path).whole().through([1.0; 3]).colour[2];
    let chord = 2.0 * (0.64_f64 - (0.1_f64 / 1.5).powi(2)).sqrt();
    let code = 1.055 * (-TINT[2] * chord / 2.4).exp() - 0.055;
    assert!((white - code).abs() < 0.01, "{white} {code}"); // 1 % of the length lies in the edge
    let camera_inside = Ray { origin: Vec3::zero(), direction: vec3(1.0, 0.0, 0.0) };
    let path = tracer(&medium, &domain).trace(&camera_inside);
    let white = Absorption::new(&medium, &path).whole().through([1.0; 3]).colour[2];
    let code = 1.055 * (-TINT[2] * 0.8 / 2.4).exp() - 0.055;
    assert!((white - code).abs() < 0.01, "{white} {code}");
}

#[test]
fn gradients_of_absorbing_bodies_match_central_differences() {
    for graded in [false, true] {
        for seed in 1..4 {
            let medium = tinted(scene(seed, graded));
            let worst = worst_errors(medium.clone(), &rays(&medium, 8));
            assert!(worst.iter().all(|e| *e < TOLERANCE), "level set, index, ray, coefficients: {worst:?}");
        }
    }
}

#[test]
fn gradients_of_absorbing_lenses_match_central_differences() {
    let n = |x: Vec3<f64>| 1.0 + 0.5 * ramp(x.length() - 0.5, 0.2) + 0.05 * x.x;
    let lens = medium(1.2, 21, Interpolation::CubicBSpline, n);
    let (medium, domain) = (tinted(lens), domain());
    let of = |y: f64| {
        let ray = Ray { origin: vec3(-2.0, y, 0.1), direction: vec3(1.0, -0.2, 0.05).normalized() };
        let path = tracer(&medium, &domain).trace(&ray);
        (ray, path)
    };
    let worst = worst_errors(medium.clone(), &[of(0.3), of(0.5), of(0.1)]);
    assert!(worst.iter().all(|e| *e < TOLERANCE), "level set, index, ray, coefficients: {worst:?}");
}

/// ⟨v, Jw⟩ = ⟨Jᵀv, w⟩ for the thickness at points as a function of the coefficients, which is linear.
#[test]
fn thickness_and_its_transpose_agree() {
    let medium = tinted(scene(2, true));
    let mut r = Sequence(3);
    for (_, path) in rays(&medium, 6) {
        let (mut adjoint, mut forward) = (AbsorptionAdjoint::default(), 0.0);
        adjoint.clear(path.segments.len());
        let absorption = Absorption::new(&medium, &path);
        for (segment, step) in path.steps.iter().enumerate() {
            let (t, v) = (0.4 * step.drift, r.next());
            adjoint.add(segment, t, [v, 0.0, 0.0]);
            // Above the toe, thickness is −γ times the logarithm of the factor on code + 0.055.
            let k = (absorption.filter(segment, t).through([1.0; 3]).colour[0] + 0.055) / 1.055;
            forward += v * -2.4 * k.ln();
        }
        let mut d = 0.0;
        let mut segments = vec![SegmentAdjoint::default(); path.segments.len()];
        adjoint.vjp(&medium, &path, &mut segments, |_, by| d += by[0]);
        assert!((forward - d * TINT[0]).abs() < 1e-10, "{forward} {}", d * TINT[0]);
    }
}
