//! Scenes of bodies with a sharp surface: balls, blobs, vessels, facets, hollow and tinted glass.

use super::super::hash::{mix, unit};
use super::super::medium::{Index, Medium};
use super::super::scene::{Body, Scene};
use super::super::shape::{Polyhedron, Primitive, Shape, TriangleMesh};
use super::super::texture::{Texture, rgb};
use super::surroundings::{GROUND, MIDDLE, Setting};
use refraxel_core::{Vec3, vec3};
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

pub(super) const UP: Vec3<f64> = Vec3::new(0.0, 0.0, 1.0);

pub(super) fn glass(s: &Setting, shape: Shape) -> Body {
    Body::refractive("glass", shape, Medium::clear(s.ior), 1)
}

fn middle() -> Vec3<f64> {
    MIDDLE.into()
}

pub(super) fn opaque(s: &Setting) -> Scene {
    let totem = vec![
        Primitive::Sphere { center: vec3(0.0, 0.0, -0.42), radius: 0.27 },
        Primitive::Torus {
            center: vec3(0.0, 0.0, -0.1),
            axis: vec3(0.2, 0.1, 1.0).normalized(),
            major: 0.26,
            minor: 0.07,
        },
        Primitive::Capsule { from: vec3(0.0, 0.0, -0.2), to: vec3(0.1, -0.05, 0.35), radius: 0.1 },
        Primitive::Disk {
            center: vec3(0.1, -0.05, 0.4),
            axis: vec3(0.3, 0.0, 1.0).normalized(),
            disk: 0.15,
            radius: 0.05,
        },
    ];
    s.scene(vec![Body::opaque("totem", Shape::implicit(totem, 0.08), s.texture(10, 0.14))])
}

pub(super) fn glazed_vase(s: &Setting) -> Scene {
    let dark = Texture::Plain(rgb(0x1b2a41));
    s.scene(vec![Body::glazed("vase", vase([0.02, -0.03], 1.0), dark, s.ior)])
}

/// A vase that stands on the ground, 1.05 high for `scale` 1.
pub(super) fn vase([x, y]: [f64; 2], scale: f64) -> Shape {
    let at = |z: f64| vec3(x, y, GROUND + (z - GROUND) * scale);
    let parts = vec![
        Primitive::Sphere { center: at(-0.36), radius: 0.32 * scale },
        Primitive::Capsule { from: at(-0.2), to: at(0.22), radius: 0.11 * scale },
        Primitive::Torus { center: at(0.3), axis: UP, major: 0.13 * scale, minor: 0.05 * scale },
    ];
    Shape::implicit(parts, 0.1 * scale)
}

pub(super) fn glass_ball(s: &Setting) -> Scene {
    s.scene(vec![glass(s, Shape::sphere(MIDDLE, 0.48))])
}

pub(super) fn hidden_ball(s: &Setting) -> Scene {
    let mut bodies = vec![glass(s, Shape::sphere([0.0, 0.0, -0.25], 0.38))];
    for k in 0..4_u32 {
        let a = f64::from(k) * TAU / 5.0;
        let at = |z| s.at(0.52 * a.cos(), 0.52 * a.sin(), z).to_array();
        let column = Shape::cylinder(at(GROUND), at(0.1 + 0.08 * f64::from(k)), 0.07);
        bodies.push(Body::opaque("column", column, s.texture(20 + u64::from(k), 0.11)));
    }
    let wall = Polyhedron::around(
        s.at(0.16, -0.56, -0.5),
        [
            (s.at(0.3, -1.0, 0.0), 0.03),
            (s.at(-0.3, 1.0, 0.0), 0.03),
            (s.at(1.0, 0.3, 0.0), 0.3),
            (s.at(-1.0, -0.3, 0.0), 0.3),
            (UP, 0.28),
            (-UP, 0.2),
        ],
    );
    bodies.push(Body::opaque("slab", Shape::Polyhedron(wall), s.texture(25, 0.12)));
    s.scene(bodies)
}

pub(super) fn glass_blob(s: &Setting) -> Scene {
    let parts = vec![
        Primitive::Sphere { center: vec3(-0.24, -0.1, -0.28), radius: 0.23 },
        Primitive::Sphere { center: vec3(0.25, -0.12, -0.2), radius: 0.2 },
        Primitive::Sphere { center: vec3(0.02, 0.24, -0.12), radius: 0.21 },
        Primitive::Sphere { center: vec3(0.03, 0.0, 0.18), radius: 0.15 },
    ];
    s.scene(vec![glass(s, Shape::implicit(parts, 0.22))])
}

pub(super) fn wine_glass(s: &Setting) -> Scene {
    let bowl =
        Primitive::Bowl { center: vec3(0.0, 0.0, 0.1), axis: UP, sphere: 0.36, rim: 0.22, radius: 0.04 };
    let stem = Primitive::Capsule { from: vec3(0.0, 0.0, -0.64), to: vec3(0.0, 0.0, -0.26), radius: 0.045 };
    let foot = Primitive::Disk { center: vec3(0.0, 0.0, -0.645), axis: UP, disk: 0.24, radius: 0.035 };
    s.scene(vec![glass(s, Shape::implicit(vec![bowl, stem, foot], 0.1))])
}

/// A round brilliant of girdle radius 0.5: table 57 %, crown 34.5°, pavilion 40.75° (Tolkowsky's angles), with star and
/// lower girdle facets.
pub(super) fn diamond(s: &Setting) -> Scene {
    const RADIUS: f64 = 0.5;
    const GIRDLE: f64 = 0.012; // half height
    let slope = |sign: f64, degrees: f64, around: f64, reach: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (vec3(sin * around.cos(), sin * around.sin(), sign * cos), reach)
    };
    let through = |degrees: f64, radius: f64, height: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        radius * sin + height * cos
    };
    let table = GIRDLE + 0.43 * RADIUS * 34.5_f64.to_radians().tan();
    let mut faces = vec![(UP, table)];
    for k in 0..8 {
        let (a, b) = (f64::from(k) * TAU / 8.0, (f64::from(k) + 0.5) * TAU / 8.0);
        faces.push(slope(1.0, 34.5, a, through(34.5, RADIUS, GIRDLE)));
        faces.push(slope(1.0, 20.0, b, through(20.0, 0.585 * RADIUS, table)));
        faces.push(slope(-1.0, 40.75, a, through(40.75, RADIUS, GIRDLE)));
        faces.push(slope(-1.0, 42.5, b, through(42.5, 1.0 * RADIUS, GIRDLE)));
    }
    faces.extend((0..16).map(|k| slope(0.0, 90.0, f64::from(k) * TAU / 16.0, RADIUS)));
    let tilt = |n: Vec3<f64>| {
        let (sin, cos) = 58_f64.to_radians().sin_cos();
        vec3(cos * n.x + sin * n.z, n.y, -sin * n.x + cos * n.z)
    };
    let faces = faces.into_iter().map(|(n, d)| (tilt(n), d));
    s.scene(vec![glass(s, Shape::Polyhedron(Polyhedron::around(vec3(0.02, 0.0, -0.12), faces)))])
}

/// A right-angled prism standing on an end: what is seen through a leg has been reflected totally by the long side.
pub(super) fn prism(s: &Setting) -> Scene {
    let (h, along) = (FRAC_1_SQRT_2, s.at(0.9, 0.44, 0.0).normalized());
    let across = UP.cross(along);
    let faces =
        [(along, 0.16), ((across - along) * h, 0.24), ((-across - along) * h, 0.24), (UP, 0.48), (-UP, 0.48)];
    s.scene(vec![glass(s, Shape::Polyhedron(Polyhedron::around(vec3(0.0, 0.0, -0.15), faces)))])
}

pub(super) fn hollow_ball(s: &Setting) -> Scene {
    let shell = glass(s, Shape::sphere(MIDDLE, 0.5));
    let cavity = Body::refractive("air", Shape::sphere(MIDDLE, 0.4), Medium::clear(1.0), 2);
    let (a, b, c) = (vec3(0.8, 0.6, 0.0), vec3(-0.48, 0.64, 0.6), vec3(0.36, -0.48, 0.8));
    let cube = Polyhedron::around(middle(), [a, -a, b, -b, c, -c].map(|n| (n, 0.17)));
    s.scene(vec![shell, cavity, Body::opaque("cube", Shape::Polyhedron(cube), s.texture(30, 0.11))])
}

/// Three bubbles in a block that stands on the ground, turned so that its faces lie along no axis.
pub(super) fn bubble(s: &Setting) -> Scene {
    let (a, b) = (vec3(0.9, 0.44, 0.0).normalized(), vec3(-0.44, 0.9, 0.0).normalized());
    let center = vec3(0.0, 0.0, -0.29);
    let faces = [(a, 0.42), (-a, 0.42), (b, 0.36), (-b, 0.36), (UP, 0.4), (-UP, 0.4)];
    let air = |along: [f64; 3], radius| {
        let at = center + a * along[0] + b * along[1] + UP * along[2];
        Body::refractive("air", Shape::sphere(at.to_array(), radius), Medium::clear(1.0), 2)
    };
    s.scene(vec![
        glass(s, Shape::Polyhedron(Polyhedron::around(center, faces))),
        air([0.04, -0.02, 0.03], 0.22),
        air([-0.25, 0.16, 0.24], 0.09),
        air([0.27, -0.2, -0.22], 0.07),
    ])
}

/// A ball before an upright slab with a round edge: from about half of all views, rays pass through both.
pub(super) fn pair(s: &Setting) -> Scene {
    let ball = Shape::sphere([-0.176, -0.102, -0.2], 0.24);
    let axis = vec3(0.86, 0.5, 0.0).normalized();
    let slab = Primitive::Disk { center: vec3(0.144, 0.084, -0.29), axis, disk: 0.3, radius: 0.1 };
    s.scene(vec![
        Body::refractive("ball", ball, Medium::clear(s.ior), 1),
        Body::refractive("slab", Shape::implicit(vec![slab], 0.0), Medium::clear(1.33), 1),
    ])
}

pub(super) fn faceted(s: &Setting) -> Scene {
    s.scene(vec![glass(s, stone_around(vec3(0.02, -0.03, -0.17)))])
}

/// A stone with twenty flat faces whose directions and distances are irregular.
pub(super) fn stone_around(center: Vec3<f64>) -> Shape {
    const FACES: u32 = 20;
    let golden = TAU * 0.5 * (5.0_f64.sqrt() - 1.0);
    // Directions spread evenly, then disturbed by up to half their spacing. With these numbers every face keeps a part of
    // the surface, which a test checks.
    let face = |k: u32| {
        let draw = |i: u64| 2.0 * unit(mix(u64::from(k), i)) - 1.0;
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(FACES);
        let (sin, cos) = (f64::from(k) * golden).sin_cos();
        let even = vec3(cos, sin, 0.0) * (1.0 - z * z).sqrt() + UP * z;
        (even + vec3(draw(1), draw(2), draw(3)) * 0.3, 0.45 * (1.0 + 0.08 * draw(4)))
    };
    Shape::Polyhedron(Polyhedron::around(center, (0..FACES).map(face)))
}

pub(super) fn two_indices(s: &Setting) -> Scene {
    let ball = Body::refractive("ball", Shape::sphere([-0.27, -0.1, -0.22], 0.3), Medium::clear(s.ior), 1);
    let capsule = Primitive::Capsule { from: vec3(0.3, -0.15, -0.4), to: vec3(0.36, 0.2, 0.1), radius: 0.2 };
    let capsule = Body::refractive("capsule", Shape::implicit(vec![capsule], 0.0), Medium::clear(1.33), 1);
    s.scene(vec![ball, capsule])
}

pub(super) fn tinted_glass(s: &Setting) -> Scene {
    let tinted = |absorption| Medium { index: Index::Constant { ior: s.ior }, absorption };
    let ring = Primitive::Torus {
        center: middle(),
        axis: vec3(0.25, -0.3, 1.0).normalized(),
        major: 0.42,
        minor: 0.12,
    };
    s.scene(vec![
        Body::refractive("amber ring", Shape::implicit(vec![ring], 0.0), tinted([0.2, 1.6, 6.0]), 1),
        Body::refractive("teal ball", Shape::sphere(MIDDLE, 0.26), tinted([3.5, 0.5, 0.7]), 1),
    ])
}

pub(super) fn glass_mesh(s: &Setting) -> Scene {
    let mesh = s.mesh.clone().unwrap_or_else(knot).fitted(middle(), 0.52);
    s.scene(vec![glass(s, Shape::Mesh(mesh))])
}

/// A trefoil knot swept by a circle.
fn knot() -> TriangleMesh {
    const ALONG: u32 = 240;
    const AROUND: u32 = 32;
    let core = |t: f64| {
        vec3(t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos(), -(3.0 * t).sin()) * 0.3
    };
    let vertex = |i: u32, j: u32| {
        let (t, a) = (TAU * f64::from(i) / f64::from(ALONG), TAU * f64::from(j) / f64::from(AROUND));
        let tangent = (core(t + 1e-4) - core(t - 1e-4)).normalized();
        // The frame is tied to the radial direction of the knot's torus, so it closes after one turn.
        let across = (core(t) - tangent * core(t).dot(tangent)).normalized();
        core(t) + (across * a.cos() + tangent.cross(across) * a.sin()) * 0.2
    };
    let number = |i: u32, j: u32| (i % ALONG) * AROUND + j % AROUND;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..ALONG {
        for j in 0..AROUND {
            vertices.push(vertex(i, j));
            let [a, b, c, d] = [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
            triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    TriangleMesh::new(vertices, triangles).unwrap_or_else(|e| unreachable!("the knot is a mesh: {e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_knot_is_oriented_outwards() {
        let mesh = Shape::Mesh(knot());
        let ray = refraxel_core::Ray { origin: vec3(3.0, 0.1, 0.2), direction: vec3(-1.0, 0.0, 0.0) };
        let mut crossings = 0;
        let mut at = ray;
        while let Some(c) = mesh.hit(&at, f64::INFINITY) {
            assert_eq!(c.normal.dot(at.direction) < 0.0, crossings % 2 == 0);
            at.origin = at.at(c.s);
            crossings += 1;
        }
        assert!(crossings >= 2 && crossings % 2 == 0, "{crossings}");
    }
}
