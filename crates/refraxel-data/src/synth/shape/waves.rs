//! A block of water whose surface is a sum of plane waves.
//!
//! A ray meets the surface where f = z − h(x, y) changes its sign. The steps along the ray are guaranteed not to pass a
//! sign change (Kalra & Barr 1989), because first and second derivatives of a sum of sines have simple bounds.

use super::convex::{Cuboid, Interval};
use super::crossing::{Crossing, S_MIN};
use super::root::{Along, sign_change};
use crate::synth::vector;
use refraxel_core::{Aabb, Ray, Vec3, vec3};
use serde::{Deserialize, Serialize};

/// The block in which a ray is followed ends this far above the highest crest [scene unit], so that no crest touches it.
const ABOVE: f64 = 1e-3;

/// A plane wave a sin(k · (x, y) + φ).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wave {
    /// Amplitude a [scene unit].
    pub amplitude: f64,
    /// Wave vector k [rad / scene unit]; the wavelength is 2π / |k|.
    pub vector: [f64; 2],
    /// Phase φ [rad].
    pub phase: f64,
}

impl Wave {
    fn argument(&self, x: Vec3<f64>) -> f64 {
        self.across(x) + self.phase
    }

    /// k · (x, y).
    fn across(&self, x: Vec3<f64>) -> f64 {
        self.vector[0] * x.x + self.vector[1] * x.y
    }
}

/// All points of an upright block below the waves, theory (6.12): z < h(x, y) = level + Σ a sin(k · (x, y) + φ).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeightField {
    /// Corner of smallest coordinates; its z is the flat bottom [scene unit].
    #[serde(with = "vector")]
    pub min: Vec3<f64>,
    /// Largest (x, y) [scene unit].
    pub max: [f64; 2],
    /// Mean height of the surface [scene unit]; the bottom must lie below every trough.
    pub level: f64,
    /// The waves; none for a flat surface.
    pub waves: Vec<Wave>,
}

/// Largest distance over which f keeps its sign, theory (6.13).
///
/// `f` at the start and its derivative away from 0; |f''| <= `curvature`. Infinite where f never reaches 0.
fn clear_step(f: f64, away: f64, curvature: f64) -> f64 {
    let root = (away * away + 2.0 * curvature * f.abs()).sqrt();
    if away < 0.0 {
        2.0 * f.abs() / (root - away)
    } else if curvature > 0.0 {
        (away + root) / curvature
    } else {
        f64::INFINITY
    }
}

impl HeightField {
    /// h and its gradient (∂h/∂x, ∂h/∂y, 0) at the (x, y) of a point.
    fn height(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        self.waves.iter().fold((self.level, Vec3::zero()), |(h, gradient), w| {
            let (sin, cos) = w.argument(x).sin_cos();
            let slope = w.amplitude * cos;
            (h + w.amplitude * sin, gradient + vec3(w.vector[0], w.vector[1], 0.0) * slope)
        })
    }

    /// f = z − h and its derivative along a ray.
    fn along(&self, ray: &Ray<f64>, s: f64) -> Along {
        let x = ray.at(s);
        let (h, gradient) = self.height(x);
        Along { value: x.z - h, slope: ray.direction.z - gradient.dot(ray.direction) }
    }

    /// Sum of amplitudes [scene unit].
    fn reach(&self) -> f64 {
        self.waves.iter().map(|w| w.amplitude.abs()).sum()
    }

    /// The part of a line in the block that contains all of the body.
    fn block(&self, ray: &Ray<f64>) -> Option<Interval> {
        let max = vec3(self.max[0], self.max[1], self.level + self.reach() + ABOVE);
        Cuboid { min: self.min, max }.interval(ray)
    }

    pub(super) fn hit(&self, ray: &Ray<f64>, s_max: f64) -> Option<Crossing> {
        let Interval { enter, leave } = self.block(ray)?;
        let start = enter.s.max(S_MIN);
        if start >= leave.s.min(s_max) {
            return None;
        }
        let is_inside = self.along(ray, start).value < 0.0;
        if is_inside && enter.s > S_MIN {
            return Some(enter);
        }
        if let Some(s) = self.first_sign_change(ray, [start, leave.s.min(s_max)]) {
            return (s < s_max).then(|| Crossing { s, normal: self.normal(ray.at(s)) });
        }
        (is_inside && leave.s < s_max).then_some(leave)
    }

    /// The first sign change of f between two arc lengths.
    ///
    /// A step is never shorter than `S_MIN`, where (6.13) shrinks to 0: right before a crossing, and where a ray only
    /// touches the surface.
    fn first_sign_change(&self, ray: &Ray<f64>, [start, end]: [f64; 2]) -> Option<f64> {
        let bend = |w: &Wave| w.amplitude.abs() * w.across(ray.direction).powi(2);
        let curvature = self.waves.iter().map(bend).sum();
        let (mut s, mut at) = (start, self.along(ray, start));
        let is_outside = at.value >= 0.0;
        while s < end {
            let away = if is_outside { at.slope } else { -at.slope };
            let next = s + clear_step(at.value, away, curvature).max(S_MIN);
            if next == f64::INFINITY {
                return None;
            }
            let after = self.along(ray, next);
            if (after.value >= 0.0) != is_outside {
                let root = sign_change([s, next], is_outside, |s| self.along(ray, s));
                return (root < end).then_some(root);
            }
            (s, at) = (next, after);
        }
        None
    }

    /// Outward unit normal of the waves above or below a point.
    fn normal(&self, x: Vec3<f64>) -> Vec3<f64> {
        (vec3(0.0, 0.0, 1.0) - self.height(x).1).normalized()
    }

    /// A lower bound of the distance to the waves, theory (6.14), exact to first order near them; negative below them.
    fn distance(&self, x: Vec3<f64>) -> f64 {
        let (h, gradient) = self.height(x);
        let squared = |w: &Wave| w.vector[0] * w.vector[0] + w.vector[1] * w.vector[1];
        let curvature = self.waves.iter().map(|w| w.amplitude.abs() * squared(w)).sum();
        let slope = self.waves.iter().map(|w| w.amplitude.abs() * squared(w).sqrt()).sum::<f64>();
        let f = x.z - h;
        let near = clear_step(f, -(1.0 + gradient.dot(gradient)).sqrt(), curvature);
        near.max(f.abs() / (1.0 + slope * slope).sqrt()).copysign(f)
    }

    pub(super) fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        let max = vec3(self.max[0], self.max[1], f64::INFINITY);
        let block = Cuboid { min: self.min, max }.surface(x);
        let waves = self.distance(x);
        if waves >= block.0 { (waves, self.normal(x)) } else { block }
    }

    pub(super) fn bounds(&self) -> Aabb<f64> {
        Aabb::new(self.min, vec3(self.max[0], self.max[1], self.level + self.reach()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shape;
    use super::*;

    fn wavy() -> HeightField {
        let wave = |amplitude, vector, phase| Wave { amplitude, vector, phase };
        HeightField {
            min: vec3(-0.6, -0.5, -0.7),
            max: [0.5, 0.6],
            level: -0.2,
            waves: vec![
                wave(0.03, [9.0, 4.0], 0.3),
                wave(-0.02, [-5.0, 12.0], 1.7),
                wave(0.01, [15.0, -13.0], 4.0),
            ],
        }
    }

    fn ray(k: u32) -> Ray<f64> {
        let t = f64::from(k);
        let origin = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalized() * 2.0;
        let target = vec3((t * 2.1).sin(), (t * 0.9).cos(), -0.6 + 0.4 * (t * 1.7).sin()) * 0.5;
        Ray { origin, direction: (target - origin).normalized() }
    }

    #[test]
    fn a_sea_without_waves_is_a_box() {
        let flat = Shape::HeightField(HeightField { waves: vec![], ..wavy() });
        let still =
            HeightField { waves: vec![Wave { amplitude: 0.0, vector: [3.0, 1.0], phase: 1.0 }], ..wavy() };
        let still = Shape::HeightField(still);
        let exact = Shape::cuboid([-0.6, -0.5, -0.7], [0.5, 0.6, -0.2]);
        let mut met = 0;
        for k in 0..600 {
            let mut r = ray(k);
            while let Some(b) = exact.hit(&r, 9.0) {
                for a in [flat.hit(&r, 9.0).unwrap(), still.hit(&r, 9.0).unwrap()] {
                    assert!(
                        (a.s - b.s).abs() * b.normal.dot(r.direction).abs() < 1e-14 && a.normal == b.normal
                    );
                }
                assert_eq!(flat.surface(r.at(b.s - 0.1)), exact.surface(r.at(b.s - 0.1)));
                r.origin = r.at(b.s);
                met += 1;
            }
            assert!(flat.hit(&r, 9.0).is_none() && still.hit(&r, 9.0).is_none());
        }
        assert!(met > 300, "{met}");
    }

    #[test]
    fn crossings_alternate_lie_on_the_waves_and_none_is_missed() {
        let (body, mut crossings) = (wavy(), 0);
        for k in 0..600 {
            let (mut r, mut entering) = (ray(k), true);
            while let Some(c) = body.hit(&r, f64::INFINITY) {
                // No sign change on the way, looked for in 500 places.
                let distance = |i: u32| body.surface(r.at(c.s * f64::from(i) / 501.0)).0;
                let side = if entering { 1.0 } else { -1.0 };
                assert!((1..=500).all(|i| side * distance(i) > -1e-14), "ray {k}");
                r.origin = r.at(c.s);
                assert!(body.surface(r.origin).0.abs() < 1e-14);
                assert_eq!(c.normal.dot(r.direction) < 0.0, entering, "ray {k}");
                assert!((c.normal - body.surface(r.origin).1).length() < 1e-12);
                entering = !entering;
                crossings += 1;
            }
            assert!(entering, "ray {k} never left");
        }
        assert!(crossings > 400, "{crossings}");
    }

    #[test]
    fn rays_that_graze_the_crests_meet_every_wave_that_a_dense_search_finds() {
        let (body, mut found) = (wavy(), 0);
        for k in 0..100_u32 {
            let (a, t) = (f64::from(k) * 0.37, f64::from(k) / 100.0);
            let direction = vec3(a.cos(), a.sin(), 0.02 * (t - 0.5));
            let middle = vec3(0.05 * (3.0 * a).sin(), 0.0, -0.26 + 0.12 * t);
            let mut r = Ray { origin: middle - direction * 2.0, direction: direction.normalized() };
            let inside: Vec<bool> =
                (0..20_000).map(|i| body.surface(r.at(f64::from(i) * 2e-4)).0 < 0.0).collect();
            let expected = inside.windows(2).filter(|w| w[0] != w[1]).count();
            let mut seen = 0;
            while let Some(c) = body.hit(&r, f64::INFINITY) {
                r.origin = r.at(c.s);
                seen += 1;
            }
            assert!(seen >= expected && seen % 2 == 0, "ray {k}: {seen} of {expected}");
            found += seen;
        }
        assert!(found > 200, "{found}");
    }

    #[test]
    fn the_normal_is_the_derivative_of_the_height() {
        let (body, h) = (wavy(), 1e-6);
        for k in 0..200_u32 {
            let t = f64::from(k);
            let x = vec3((t * 0.71).sin(), (t * 1.3).cos(), 0.0) * 0.5;
            let central = [vec3(h, 0.0, 0.0), vec3(0.0, h, 0.0)]
                .map(|e| (body.height(x + e).0 - body.height(x - e).0) / (2.0 * h));
            let normal = vec3(-central[0], -central[1], 1.0).normalized();
            assert!((body.normal(x) - normal).length() < 1e-8); // h² and f64 eps / h
        }
    }

    #[test]
    fn the_distance_is_a_lower_bound_and_exact_to_first_order() {
        let body = wavy();
        for k in 0..300_u32 {
            let t = f64::from(k);
            let x = vec3((t * 0.71).sin() * 0.3, (t * 1.3).cos() * 0.3, -0.2 + 0.15 * (t * 2.3).sin());
            let bound = body.distance(x).abs();
            // The nearest of many points of the waves is never nearer than the bound.
            let point = |i: u32| {
                x + vec3((f64::from(i) * 2.4).cos(), (f64::from(i) * 2.4).sin(), 0.0) * (f64::from(i) * 1e-4)
            };
            let nearest = (0..2000).map(|i| {
                let q = point(i);
                (x - vec3(q.x, q.y, body.height(q).0)).length()
            });
            assert!(nearest.fold(f64::INFINITY, f64::min) >= bound - 1e-12);
            let foot = vec3(x.x, x.y, body.height(x).0);
            for d in [1e-4, -1e-4] {
                assert!((body.distance(foot + body.normal(x) * d) - d).abs() < 2e-7); // curvature times d²
            }
        }
    }

    #[test]
    fn the_clear_step_ends_at_the_first_root_of_a_parabola() {
        // f = 1 + v s − M s² / 2 has its root where the bound says, for either sign of v.
        for (v, m) in [(0.5, 2.0), (-0.5, 2.0), (0.0, 3.0), (-2.0, 0.0)] {
            let s = clear_step(1.0, v, m);
            assert!((1.0 + v * s - 0.5 * m * s * s).abs() < 1e-12);
            assert_eq!(clear_step(-1.0, v, m), s);
        }
        assert_eq!(clear_step(1.0, 0.5, 0.0), f64::INFINITY);
    }
}
