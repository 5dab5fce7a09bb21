//! A shape of any kind.

use super::convex::{Cuboid, Cylinder, Polyhedron, Sphere};
use super::crossing::Crossing;
use super::implicit::Implicit;
use super::mesh::TriangleMesh;
use super::primitive::Primitive;
use super::rectangle::Rectangle;
use super::waves::HeightField;
use refraxel_core::{Aabb, Ray, Vec3, vec3};
use serde::{Deserialize, Serialize};

/// A shape of a scene; in `scene.json` its name stands under the key `shape`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "snake_case")]
pub enum Shape {
    /// A ball, in closed form.
    Sphere(Sphere),
    /// An axis-aligned box, in closed form.
    Box(Cuboid),
    /// A capped cylinder of any direction, in closed form.
    Cylinder(Cylinder),
    /// An intersection of half-spaces (prism, cut gem, turned box), in closed form.
    Polyhedron(Polyhedron),
    /// A horizontal, two-sided rectangle without an inside; for opaque ground only.
    Rectangle(Rectangle),
    /// A smooth union of exact distance fields, found by sphere tracing.
    Implicit(Implicit),
    /// A closed triangle mesh with smooth normals.
    Mesh(TriangleMesh),
    /// A block whose top is a sum of plane waves, exact to rounding.
    HeightField(HeightField),
}

impl Shape {
    /// First crossing with `S_MIN < s < s_max`.
    #[inline]
    pub fn hit(&self, ray: &Ray<f64>, s_max: f64) -> Option<Crossing> {
        match self {
            Shape::Sphere(s) => s.interval(ray).and_then(|i| i.first(s_max)),
            Shape::Box(s) => s.interval(ray).and_then(|i| i.first(s_max)),
            Shape::Cylinder(s) => s.interval(ray).and_then(|i| i.first(s_max)),
            Shape::Polyhedron(s) => s.interval(ray).and_then(|i| i.first(s_max)),
            Shape::Rectangle(s) => s.hit(ray, s_max),
            Shape::Implicit(s) => s.hit(ray, s_max),
            Shape::Mesh(s) => s.hit(ray, s_max),
            Shape::HeightField(s) => s.hit(ray, s_max),
        }
    }

    /// Signed distance or a lower bound of it (negative inside) and the outward unit normal of the nearest surface.
    ///
    /// Exact distance near the surface; for boxes, cylinders, polyhedra and height fields the distance to the
    /// most violated face elsewhere. A rectangle counts as the half-space below it.
    pub fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        match self {
            Shape::Sphere(s) => s.surface(x),
            Shape::Box(s) => s.surface(x),
            Shape::Cylinder(s) => s.surface(x),
            Shape::Polyhedron(s) => s.surface(x),
            Shape::Rectangle(s) => (x.z - s.z, vec3(0.0, 0.0, 1.0)),
            Shape::Implicit(s) => s.surface(x),
            Shape::Mesh(s) => s.surface(x),
            Shape::HeightField(s) => s.surface(x),
        }
    }

    /// True for points strictly inside; a rectangle has no inside.
    pub fn contains(&self, x: Vec3<f64>) -> bool {
        match self {
            Shape::Rectangle(_) => false,
            Shape::Mesh(s) => s.bounds().contains(x) && s.contains(x),
            _ => self.surface(x).0 < 0.0,
        }
    }

    /// A box that contains the shape (tight for the closed forms).
    pub fn bounds(&self) -> Aabb<f64> {
        match self {
            Shape::Sphere(s) => Aabb::cube_at(s.center, s.radius),
            Shape::Box(s) => Aabb::new(s.min, s.max),
            Shape::Cylinder(s) => s.bounds(),
            Shape::Polyhedron(s) => s.bounds(),
            Shape::Rectangle(s) => Aabb::new(vec3(s.min[0], s.min[1], s.z), vec3(s.max[0], s.max[1], s.z)),
            Shape::Implicit(s) => s.bounds(),
            Shape::Mesh(s) => s.bounds(),
            Shape::HeightField(s) => s.bounds(),
        }
    }

    /// Faces, parts or waves that it is made of.
    pub(in crate::synth) fn pieces(&self) -> usize {
        match self {
            Shape::Polyhedron(s) => s.faces.len(),
            Shape::Implicit(s) => s.pieces(),
            Shape::HeightField(s) => s.waves.len(),
            _ => 1,
        }
    }

    /// A ball.
    pub fn sphere(center: [f64; 3], radius: f64) -> Shape {
        Shape::Sphere(Sphere { center: center.into(), radius })
    }

    /// An axis-aligned box.
    pub fn cuboid(min: [f64; 3], max: [f64; 3]) -> Shape {
        Shape::Box(Cuboid { min: min.into(), max: max.into() })
    }

    /// A capped cylinder between the centres of its caps.
    pub fn cylinder(from: [f64; 3], to: [f64; 3], radius: f64) -> Shape {
        Shape::Cylinder(Cylinder { from: from.into(), to: to.into(), radius })
    }

    /// One distance field, or several melted together over a length `blend` [scene unit].
    pub fn implicit(parts: Vec<Primitive>, blend: f64) -> Shape {
        Shape::Implicit(Implicit::new(parts, blend))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_reads_back_from_json_as_it_was_written() {
        let shape = Shape::implicit(
            vec![Primitive::Torus {
                center: vec3(0.0, 0.1, 0.2),
                axis: vec3(0.0, 0.0, 1.0),
                major: 0.3,
                minor: 0.1,
            }],
            0.05,
        );
        let text = serde_json::to_string(&shape).unwrap();
        let back: Shape = serde_json::from_str(&text).unwrap();
        let x = vec3(0.3, 0.2, 0.1);
        assert_eq!(shape.surface(x), back.surface(x));
        assert!(text.starts_with(r#"{"shape":"implicit""#), "{text}");
    }

    #[test]
    fn a_rectangle_is_met_from_both_sides_and_only_within_its_edges() {
        let ground = Shape::Rectangle(Rectangle { min: [-1.0, -1.0], max: [1.0, 1.0], z: -0.7 });
        let down = Ray { origin: vec3(0.2, 0.3, 1.3), direction: vec3(0.0, 0.0, -1.0) };
        assert!((ground.hit(&down, 9.0).unwrap().s - 2.0).abs() < 1e-15);
        let up = Ray { origin: vec3(0.2, 0.3, -1.7), direction: vec3(0.0, 0.0, 1.0) };
        assert!((ground.hit(&up, 9.0).unwrap().s - 1.0).abs() < 1e-15);
        let beside = Ray { origin: vec3(1.2, 0.3, 1.3), direction: vec3(0.0, 0.0, -1.0) };
        assert!(ground.hit(&beside, 9.0).is_none());
    }
}
