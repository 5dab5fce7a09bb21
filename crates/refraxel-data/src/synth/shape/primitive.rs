//! Bodies with an exact distance field: all points within a radius of a core (a point, segment, circle, disk or cap).

use crate::synth::vector;
use refraxel_core::{Aabb, Vec3, vec3};
use serde::{Deserialize, Serialize};

/// A body with an exact distance field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "part", rename_all = "snake_case")]
pub enum Primitive {
    /// A ball.
    Sphere {
        /// Centre [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// Radius [scene unit].
        radius: f64,
    },
    /// All points within `radius` of a line segment.
    Capsule {
        /// One end of the segment [scene unit].
        #[serde(with = "vector")]
        from: Vec3<f64>,
        /// Other end [scene unit].
        #[serde(with = "vector")]
        to: Vec3<f64>,
        /// Radius [scene unit].
        radius: f64,
    },
    /// A ring.
    Torus {
        /// Centre [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// Unit axis.
        #[serde(with = "vector")]
        axis: Vec3<f64>,
        /// Radius of the core circle [scene unit].
        major: f64,
        /// Radius of the tube [scene unit].
        minor: f64,
    },
    /// All points within `radius` of a flat disk: a cylinder with a fully rounded edge.
    Disk {
        /// Centre [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// Unit axis.
        #[serde(with = "vector")]
        axis: Vec3<f64>,
        /// Radius of the disk [scene unit].
        disk: f64,
        /// Half thickness [scene unit].
        radius: f64,
    },
    /// All points within `radius` of the part of a sphere that lies below a plane: a bowl with a round rim.
    Bowl {
        /// Centre of the sphere [scene unit].
        #[serde(with = "vector")]
        center: Vec3<f64>,
        /// Unit axis, towards the opening.
        #[serde(with = "vector")]
        axis: Vec3<f64>,
        /// Radius of the sphere [scene unit].
        sphere: f64,
        /// Height of the rim above the centre along the axis [scene unit].
        rim: f64,
        /// Half thickness of the wall [scene unit].
        radius: f64,
    },
}

impl Primitive {
    /// The nearest point of the core (centre, segment, circle, disk, cap) and the radius around it.
    fn core(&self, x: Vec3<f64>) -> (Vec3<f64>, f64) {
        match *self {
            Primitive::Sphere { center, radius } => (center, radius),
            Primitive::Capsule { from, to, radius } => {
                let v = to - from;
                (from + v * ((x - from).dot(v) / v.dot(v)).clamp(0.0, 1.0), radius)
            }
            Primitive::Torus { center, axis, major, minor } => {
                let (_, across) = split(x - center, axis);
                (center + across * (major / across.length()), minor)
            }
            Primitive::Disk { center, axis, disk, radius } => {
                let (_, across) = split(x - center, axis);
                (center + across * (disk / across.length()).min(1.0), radius)
            }
            Primitive::Bowl { center, axis, sphere, rim, radius } => {
                let v = x - center;
                let (along, across) = split(v, axis);
                let rim_radius = (sphere * sphere - rim * rim).sqrt();
                // Below the cone through the rim the sphere is nearest, above it the rim circle.
                if rim_radius * along < rim * across.length() {
                    (center + v * (sphere / v.length()), radius)
                } else {
                    (center + axis * rim + across * (rim_radius / across.length()), radius)
                }
            }
        }
    }

    /// Signed distance, negative inside, and its gradient.
    pub(super) fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        let (nearest, radius) = self.core(x);
        let v = x - nearest;
        let r = v.length();
        (r - radius, if r > 0.0 { v / r } else { vec3(0.0, 0.0, 1.0) })
    }

    /// A box that contains the body.
    pub(super) fn bounds(&self) -> Aabb<f64> {
        let ball = |c: Vec3<f64>, r: f64| Aabb::cube_at(c, r);
        // A circle or disk of radius r across a unit axis reaches r sqrt(1 - a²) along each coordinate axis.
        let round = |c: Vec3<f64>, axis: Vec3<f64>, r: f64, pad: f64| {
            let reach = axis.map(|a| r * (1.0 - a * a).max(0.0).sqrt() + pad);
            Aabb::new(c - reach, c + reach)
        };
        match *self {
            Primitive::Sphere { center, radius } => ball(center, radius),
            Primitive::Capsule { from, to, radius } => {
                let (a, b) = (ball(from, radius), ball(to, radius));
                Aabb::new(a.min.min(b.min), a.max.max(b.max))
            }
            Primitive::Torus { center, axis, major, minor } => round(center, axis, major, minor),
            Primitive::Disk { center, axis, disk, radius } => round(center, axis, disk, radius),
            Primitive::Bowl { center, sphere, radius, .. } => ball(center, sphere + radius),
        }
    }
}

/// The coordinate of `v` along a unit axis and its part across; the latter is never the zero vector.
fn split(v: Vec3<f64>, axis: Vec3<f64>) -> (f64, Vec3<f64>) {
    let along = v.dot(axis);
    let across = v - axis * along;
    if across.dot(across) > 0.0 {
        return (along, across);
    }
    let side = if axis.x.abs() < 0.5 { vec3(1.0, 0.0, 0.0) } else { vec3(0.0, 1.0, 0.0) };
    (along, axis.cross(side) * f64::MIN_POSITIVE.sqrt())
}
