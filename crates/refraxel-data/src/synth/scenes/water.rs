//! Scenes of water with objects in it.

use super::super::elevations::Elevations;
use super::super::medium::Medium;
use super::super::scene::{Body, Scene};
use super::super::shape::{HeightField, Polyhedron, Primitive, Shape, Wave};
use super::surroundings::{GROUND, Setting};
use refraxel_core::{Vec3, vec3};

/// Objects on the floor of a tank, and a pole that reaches out of it.
pub(super) fn things(s: &Setting, floor: f64) -> Vec<Body> {
    let pole = Shape::cylinder([0.28, -0.3, floor + 0.02], [-0.12, 0.2, 0.5], 0.05);
    let ring = Primitive::Torus {
        center: vec3(-0.28, 0.22, floor + 0.17),
        axis: vec3(0.8, -0.5, 0.2).normalized(),
        major: 0.13,
        minor: 0.045,
    };
    vec![
        Body::opaque("pole", pole, s.texture(40, 0.1)),
        Body::opaque("die", die(vec3(0.3, 0.25, floor + 0.13), 0.13), s.texture(41, 0.12)),
        Body::opaque("ring", Shape::implicit(vec![ring], 0.0), s.texture(43, 0.09)),
        Body::opaque("ball", Shape::sphere([-0.24, -0.26, floor + 0.16], 0.15), s.texture(42, 0.1)),
    ]
}

/// A cube that is turned about the vertical.
fn die(center: Vec3<f64>, half: f64) -> Shape {
    let (a, b, up) = (vec3(0.8, 0.6, 0.0), vec3(-0.6, 0.8, 0.0), vec3(0.0, 0.0, 1.0));
    Shape::Polyhedron(Polyhedron::around(center, [a, -a, b, -b, up, -up].map(|n| (n, half))))
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

/// A glass of water: an open cylinder with a thick base, 60 % full, with a straw and a ball in it.
pub(super) fn drinking_glass(s: &Setting) -> Scene {
    const BASE: f64 = -0.6;
    const RIM: f64 = 0.16;
    let tumbler =
        Tumbler { radius: 0.36, wall: 0.04, base: BASE, rim: RIM, level: BASE + 0.6 * (RIM - BASE) };
    let straw = Shape::cylinder([0.16, 0.1, BASE + 0.05], [-0.34, -0.2, 0.5], 0.028);
    let ball = Shape::sphere([-0.09, 0.12, BASE + 0.115], 0.11);
    let mut bodies = vec![
        Body::opaque("straw", straw, s.texture(44, 0.09)),
        Body::opaque("ball", ball, s.texture(46, 0.08)),
    ];
    bodies.extend(tumbler.bodies(s.ior));
    s.calm_scene(bodies)
}

/// An upright vessel of glass on the ground with water in it. Lengths and heights in scene units.
pub(super) struct Tumbler {
    /// Outer radius.
    pub radius: f64,
    /// Thickness of the wall.
    pub wall: f64,
    /// Height of the inner bottom.
    pub base: f64,
    /// Height of the rim.
    pub rim: f64,
    /// Height of the water.
    pub level: f64,
}

impl Tumbler {
    /// Glass of this index, water, and the air above the water.
    pub(super) fn bodies(&self, ior: f64) -> [Body; 3] {
        let upright = |radius, low, high| Shape::cylinder([0.0, 0.0, low], [0.0, 0.0, high], radius);
        // Nested as in the aquarium: the highest priority wins, and no two surfaces coincide.
        let inner = self.radius - self.wall;
        let glass = upright(self.radius, GROUND + 0.01, self.rim);
        let water = upright(inner, self.base, self.level + 0.1);
        let air = upright(inner + 0.125 * self.wall, self.level, self.rim + 0.1);
        [
            Body::refractive("glass", glass, Medium::clear(ior), 1),
            Body::refractive("water", water, Medium::clear(1.33), 2),
            Body::refractive("air", air, Medium::clear(1.0), 3),
        ]
    }
}

pub(super) fn wavy_pool(s: &Setting) -> Scene {
    Scene { elevations: Elevations::STEEP, ..s.wide_scene(pool(s)) }
}

/// Water with waves in an opaque basin. The sides and the bottom of the water lie inside of walls and floor, so that only
/// its surface is seen.
pub(super) fn pool(s: &Setting) -> Vec<Body> {
    const FLOOR: f64 = -0.62;
    let wave = |amplitude, vector, phase| Wave { amplitude, vector, phase };
    let water = HeightField {
        min: vec3(-0.6, -0.6, FLOOR - 0.04),
        max: [0.6, 0.6],
        level: -0.22,
        waves: vec![
            wave(0.022, [9.5, 4.1], 0.3),
            wave(0.016, [-5.2, 11.8], 1.7),
            wave(0.008, [15.1, -13.3], 4.0),
        ],
    };
    let mut bodies = basin(s, FLOOR);
    bodies.extend(sunken_things(s, FLOOR));
    bodies.push(Body::refractive("water", Shape::HeightField(water), Medium::clear(s.ior), 1));
    bodies
}

/// Floor and walls of an open basin.
fn basin(s: &Setting, floor: f64) -> Vec<Body> {
    const RIM: f64 = -0.12;
    let wall = |min: [f64; 2], max: [f64; 2]| {
        let shape = Shape::cuboid([min[0], min[1], GROUND - 0.02], [max[0], max[1], RIM]);
        Body::opaque("wall", shape, s.mosaic(&[0xe8dcc6, 0xc9b18c, 0xa88a66], 47, 0.13))
    };
    let slab = Shape::cuboid([-0.6, -0.6, GROUND - 0.01], [0.6, 0.6, floor]);
    vec![
        Body::opaque("floor", slab, s.mosaic(&[0xeaf3f5, 0x8fc3cf, 0x2f7f95, 0x16475c], 48, 0.12)),
        wall([-0.65, -0.65], [-0.55, 0.65]),
        wall([0.55, -0.65], [0.65, 0.65]),
        wall([-0.56, -0.65], [0.56, -0.55]),
        wall([-0.56, 0.55], [0.56, 0.65]),
    ]
}

/// Objects on the floor of the basin, and a pole that reaches out of it.
fn sunken_things(s: &Setting, floor: f64) -> Vec<Body> {
    let pole = Shape::cylinder([0.36, 0.34, floor + 0.01], [0.1, 0.42, 0.2], 0.035);
    vec![
        Body::opaque("ball", Shape::sphere([-0.22, 0.12, floor + 0.135], 0.135), s.texture(49, 0.1)),
        Body::opaque("die", die(vec3(0.24, -0.14, floor + 0.105), 0.105), s.texture(50, 0.1)),
        Body::opaque("stone", Shape::sphere([-0.2, -0.3, floor + 0.06], 0.085), s.texture(51, 0.08)),
        Body::opaque("pole", pole, s.texture(53, 0.09)),
    ]
}
