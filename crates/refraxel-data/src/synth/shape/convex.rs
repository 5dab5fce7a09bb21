//! Convex bodies in closed form: a straight line is inside one of them over a single interval.

use super::crossing::{Crossing, S_MIN};
use crate::synth::vector;
use refraxel_core::{Aabb, Ray, Vec3, vec3};
use serde::{Deserialize, Serialize};

/// The part of a line inside a convex body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) enter: Crossing,
    pub(super) leave: Crossing,
}

impl Interval {
    /// All of the line, from which faces cut away.
    fn everything() -> Interval {
        let end = |s| Crossing { s, normal: Vec3::zero() };
        Interval { enter: end(f64::NEG_INFINITY), leave: end(f64::INFINITY) }
    }

    /// Keeps the part below a plane of outward unit `normal`; `height` of the origin above it. Returns false when nothing is
    /// left.
    #[inline]
    fn cut(&mut self, normal: Vec3<f64>, height: f64, direction: Vec3<f64>) -> bool {
        let slope = normal.dot(direction);
        if slope == 0.0 {
            return height <= 0.0;
        }
        let s = -height / slope;
        if slope < 0.0 && s > self.enter.s {
            self.enter = Crossing { s, normal };
        } else if slope > 0.0 && s < self.leave.s {
            self.leave = Crossing { s, normal };
        }
        self.enter.s < self.leave.s
    }

    /// The first end beyond the ray's start.
    #[inline]
    pub(super) fn first(&self, s_max: f64) -> Option<Crossing> {
        let c = if self.enter.s > S_MIN { self.enter } else { self.leave };
        (c.s > S_MIN && c.s < s_max).then_some(c)
    }
}

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sphere {
    /// Centre [scene unit].
    #[serde(with = "vector")]
    pub center: Vec3<f64>,
    /// Radius [scene unit].
    pub radius: f64,
}

impl Sphere {
    #[inline]
    pub(super) fn interval(&self, ray: &Ray<f64>) -> Option<Interval> {
        let from_center = ray.origin - self.center;
        let b = from_center.dot(ray.direction);
        // Distance of the line from the centre as a vector: no cancellation for far cameras.
        let closest = from_center - ray.direction * b;
        let half2 = self.radius * self.radius - closest.dot(closest);
        if half2 <= 0.0 {
            return None;
        }
        let half = half2.sqrt();
        let end = |s: f64| Crossing { s, normal: (from_center + ray.direction * s) * self.radius.recip() };
        Some(Interval { enter: end(-b - half), leave: end(-b + half) })
    }

    pub(super) fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        let v = x - self.center;
        let r = v.length();
        (r - self.radius, if r > 0.0 { v / r } else { vec3(0.0, 0.0, 1.0) })
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cuboid {
    /// Corner of smallest coordinates [scene unit].
    #[serde(with = "vector")]
    pub min: Vec3<f64>,
    /// Corner of largest coordinates [scene unit].
    #[serde(with = "vector")]
    pub max: Vec3<f64>,
}

const AXES: [Vec3<f64>; 3] = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];

impl Cuboid {
    #[inline]
    pub(super) fn interval(&self, ray: &Ray<f64>) -> Option<Interval> {
        let mut i = Interval::everything();
        for a in 0..3 {
            let (x, d) = (ray.origin[a], ray.direction);
            if !i.cut(AXES[a], x - self.max[a], d) || !i.cut(-AXES[a], self.min[a] - x, d) {
                return None;
            }
        }
        Some(i)
    }

    pub(super) fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        let mut best = (f64::NEG_INFINITY, AXES[0]);
        for a in 0..3 {
            for (height, normal) in [(x[a] - self.max[a], AXES[a]), (self.min[a] - x[a], -AXES[a])] {
                if height > best.0 {
                    best = (height, normal);
                }
            }
        }
        best
    }
}

/// A solid cylinder with flat caps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cylinder {
    /// Centre of one cap [scene unit].
    #[serde(with = "vector")]
    pub from: Vec3<f64>,
    /// Centre of the other cap [scene unit].
    #[serde(with = "vector")]
    pub to: Vec3<f64>,
    /// Radius [scene unit].
    pub radius: f64,
}

impl Cylinder {
    pub(super) fn interval(&self, ray: &Ray<f64>) -> Option<Interval> {
        let axis = (self.to - self.from).normalized();
        let v = ray.origin - self.from;
        let mut i = Interval::everything();
        let length = (self.to - self.from).length();
        if !i.cut(axis, v.dot(axis) - length, ray.direction) || !i.cut(-axis, -v.dot(axis), ray.direction) {
            return None;
        }
        // The side: a circle in the plane across the axis.
        let (x, d) = (v - axis * v.dot(axis), ray.direction - axis * ray.direction.dot(axis));
        let d2 = d.dot(d);
        if d2 == 0.0 {
            return (x.dot(x) < self.radius * self.radius).then_some(i);
        }
        let b = x.dot(d) / d2;
        let closest = x - d * b;
        let half2 = (self.radius * self.radius - closest.dot(closest)) / d2;
        if half2 <= 0.0 {
            return None;
        }
        let half = half2.sqrt();
        let end = |s: f64| Crossing { s, normal: (x + d * s) * self.radius.recip() };
        if -b - half > i.enter.s {
            i.enter = end(-b - half);
        }
        if -b + half < i.leave.s {
            i.leave = end(-b + half);
        }
        (i.enter.s < i.leave.s).then_some(i)
    }

    pub(super) fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        let axis = (self.to - self.from).normalized();
        let along = (x - self.from).dot(axis);
        let across = x - self.from - axis * along;
        let (r, length) = (across.length(), (self.to - self.from).length());
        let radial = if r > 0.0 { across / r } else { vec3(0.0, 0.0, 1.0).cross(axis) };
        [(r - self.radius, radial), (along - length, axis), (-along, -axis)]
            .into_iter()
            .fold((f64::NEG_INFINITY, axis), |a, b| if b.0 > a.0 { b } else { a })
    }

    pub(super) fn bounds(&self) -> Aabb<f64> {
        let axis = (self.to - self.from).normalized();
        let reach = axis.map(|c| self.radius * (1.0 - c * c).max(0.0).sqrt());
        Aabb::new(self.from.min(self.to) - reach, self.from.max(self.to) + reach)
    }
}

/// The half-space x · normal <= offset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plane {
    /// Outward unit normal.
    #[serde(with = "vector")]
    pub normal: Vec3<f64>,
    /// Distance from the world's origin along the normal [scene unit].
    pub offset: f64,
}

/// An intersection of half-spaces; must be bounded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polyhedron {
    /// The faces, in any order.
    pub faces: Vec<Plane>,
}

impl Polyhedron {
    /// A body around `center` from (outward normal of any length, distance of the face from the centre).
    pub fn around(center: Vec3<f64>, faces: impl IntoIterator<Item = (Vec3<f64>, f64)>) -> Polyhedron {
        let face = |(n, distance): (Vec3<f64>, f64)| {
            let normal = n.normalized();
            Plane { normal, offset: normal.dot(center) + distance }
        };
        Polyhedron { faces: faces.into_iter().map(face).collect() }
    }

    pub(super) fn interval(&self, ray: &Ray<f64>) -> Option<Interval> {
        let mut i = Interval::everything();
        for f in &self.faces {
            if !i.cut(f.normal, f.normal.dot(ray.origin) - f.offset, ray.direction) {
                return None;
            }
        }
        Some(i)
    }

    pub(super) fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        self.faces
            .iter()
            .map(|f| (f.normal.dot(x) - f.offset, f.normal))
            .fold((f64::NEG_INFINITY, AXES[0]), |a, b| if b.0 > a.0 { b } else { a })
    }

    /// The box of the corners: points common to three faces that no other face cuts off.
    pub(super) fn bounds(&self) -> Aabb<f64> {
        let mut b = Aabb::empty();
        let f = &self.faces;
        for i in 0..f.len() {
            for j in 0..i {
                for k in 0..j {
                    let (u, v, w) = (f[i].normal, f[j].normal, f[k].normal);
                    let det = u.dot(v.cross(w));
                    if det.abs() < 1e-9 {
                        continue;
                    }
                    let x = v.cross(w) * f[i].offset + w.cross(u) * f[j].offset + u.cross(v) * f[k].offset;
                    if self.surface(x / det).0 < 1e-9 {
                        b.include(x / det);
                    }
                }
            }
        }
        b
    }
}

#[cfg(test)]
mod tests {
    use super::super::Shape;
    use super::*;

    fn shapes() -> Vec<Shape> {
        let tilted = Cylinder { from: vec3(-0.2, 0.1, -0.5), to: vec3(0.3, -0.1, 0.4), radius: 0.25 };
        let gem = Polyhedron::around(
            vec3(0.1, 0.0, 0.0),
            (0..6)
                .map(|k| {
                    let a = f64::from(k);
                    (vec3(a.cos(), a.sin(), 0.4 * (2.1 * a).sin()), 0.4)
                })
                .chain([(vec3(0.0, 0.1, 1.0), 0.3), (vec3(0.1, 0.0, -1.0), 0.35)]),
        );
        vec![
            Shape::sphere([0.1, -0.05, 0.2], 0.5),
            Shape::cuboid([-0.4, -0.3, -0.2], [0.3, 0.5, 0.6]),
            Shape::Cylinder(tilted),
            Shape::Polyhedron(gem),
        ]
    }

    #[test]
    fn a_line_that_enters_leaves_again_and_both_points_lie_on_the_surface() {
        for (which, shape) in shapes().iter().enumerate() {
            let mut met = 0;
            for k in 0..400_u32 {
                let t = f64::from(k);
                let origin = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalized() * 3.0;
                let target = vec3((t * 2.1).sin(), (t * 0.9).cos(), (t * 1.7).sin()) * 0.5;
                let ray = Ray { origin, direction: (target - origin).normalized() };
                let Some(enter) = shape.hit(&ray, f64::INFINITY) else { continue };
                let inner = Ray { origin: ray.at(enter.s), direction: ray.direction };
                let leave = shape.hit(&inner, f64::INFINITY).unwrap();
                assert!(enter.normal.dot(ray.direction) < 0.0 && leave.normal.dot(ray.direction) > 0.0);
                for x in [inner.origin, inner.at(leave.s)] {
                    assert!(shape.surface(x).0.abs() < 1e-12, "shape {which}");
                }
                assert!(shape.contains(inner.at(0.5 * leave.s)));
                let beyond = Ray { origin: inner.at(leave.s), direction: ray.direction };
                assert!(shape.hit(&beyond, f64::INFINITY).is_none());
                met += 1;
            }
            assert!(met > 50, "shape {which} was met {met} times");
        }
    }

    #[test]
    fn grazing_rays_meet_a_flat_face_at_any_angle() {
        let slab = Shape::cuboid([-1.0, -1.0, -0.1], [1.0, 1.0, 0.0]);
        for angle in [1e-3_f64, 1e-5, 1e-8] {
            let ray = Ray {
                origin: vec3(-0.5, 0.0, 0.5 * angle.tan()),
                direction: vec3(angle.cos(), 0.0, -angle.sin()),
            };
            let hit = slab.hit(&ray, f64::INFINITY).unwrap();
            assert!((ray.at(hit.s).x).abs() < 1e-7 && hit.normal.z == 1.0);
        }
    }

    #[test]
    fn bounds_contain_the_surface_and_touch_it() {
        for shape in shapes() {
            let b = shape.bounds();
            for k in 0..3000_u32 {
                let t = f64::from(k);
                let x = b.center() + vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 2.37).sin()) * 1.2;
                assert!(!shape.contains(x) || b.contains(x));
            }
        }
    }
}
