//! Scenes of water with objects in it.

use super::super::medium::Medium;
use super::super::scene::{Body, Scene};
use super::super::shape::{Polyhedron, Primitive, Shape};
use super::surroundings::{GROUND, Setting};
use refraxel_core::vec3;

/// Objects on the floor of a tank, and a pole that reaches out of it.
pub(super) fn things(s: &Setting, floor: f64) -> Vec<Body> {
    let pole = Shape::cylinder([0.28, -0.3, floor + 0.02], [-0.12, 0.2, 0.5], 0.05);
    let (a, b) = (vec3(0.8, 0.6, 0.0), vec3(-0.6, 0.8, 0.0));
    let up = vec3(0.0, 0.0, 1.0);
    let die = Polyhedron::around(vec3(0.3, 0.25, floor + 0.13), [a, -a, b, -b, up, -up].map(|n| (n, 0.13)));
    let ring = Primitive::Torus {
        center: vec3(-0.28, 0.22, floor + 0.17),
        axis: vec3(0.8, -0.5, 0.2).normalized(),
        major: 0.13,
        minor: 0.045,
    };
    vec![
        Body::opaque("pole", pole, s.texture(40, 0.1)),
        Body::opaque("die", Shape::Polyhedron(die), s.texture(41, 0.12)),
        Body::opaque("ring", Shape::implicit(vec![ring], 0.0), s.texture(43, 0.09)),
        Body::opaque("ball", Shape::sphere([-0.24, -0.26, floor + 0.16], 0.15), s.texture(42, 0.1)),
    ]
}

/// A bare block of water, open on top, whose bottom lies below the opaque ground.
pub(super) fn water_tank(s: &Setting) -> Scene {
    let block = Shape::cuboid([-0.55, -0.55, GROUND - 0.05], [0.55, 0.55, 0.02]);
    let mut bodies = things(s, GROUND);
    bodies.push(Body::refractive("water", block, Medium::clear(s.ior), 1));
    s.calm_scene(bodies)
}

/// A glass tank of index 1.5, water in it, and air above the water between the walls.
pub(super) fn aquarium(s: &Setting) -> Scene {
    const FLOOR: f64 = -0.63;
    const LEVEL: f64 = -0.02;
    let tank = Shape::cuboid([-0.58, -0.58, GROUND + 0.01], [0.58, 0.58, 0.14]);
    // The media overlap, the higher priority wins: no two surfaces coincide. The air is a little wider than the water,
    // so that above the water the walls are 0.01 thinner.
    let water = Shape::cuboid([-0.52, -0.52, FLOOR], [0.52, 0.52, 0.1]);
    let air = Shape::cuboid([-0.53, -0.53, LEVEL], [0.53, 0.53, 0.3]);
    let mut bodies = things(s, FLOOR + 0.005);
    bodies.push(Body::refractive("tank", tank, Medium::clear(1.5), 1));
    bodies.push(Body::refractive("water", water, Medium::clear(s.ior), 2));
    bodies.push(Body::refractive("air", air, Medium::clear(1.0), 3));
    s.calm_scene(bodies)
}
