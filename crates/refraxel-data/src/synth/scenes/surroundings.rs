//! The surroundings of the refractive body in most scenes: a tiled ground and a ring of textured objects.

use super::super::elevations::Elevations;
use super::super::hash::{mix, unit};
use super::super::scene::{Body, Environment, Scene};
use super::super::shape::{Polyhedron, Primitive, Rectangle, Shape, TriangleMesh};
use super::super::texture::{Mosaic, Texture, rgb};
use refraxel_core::{Vec3, vec3};
use std::f64::consts::TAU;

/// Height of the ground [scene unit].
pub(super) const GROUND: f64 = -0.7;
/// Where the main body floats [scene unit].
pub(super) const MIDDLE: [f64; 3] = [0.02, -0.03, -0.13];

/// What a scene is built from: the options, resolved.
pub(super) struct Setting {
    /// Index of the main body.
    pub ior: f64,
    /// Imported mesh.
    pub mesh: Option<TriangleMesh>,
    seed: u64,
    turn: f64,
}

const PALETTES: [[u32; 5]; 4] = [
    [0xf4efe6, 0x1b3a57, 0xe0562b, 0x2f9e8f, 0xf2b632],
    [0x18222d, 0xf7d54a, 0x3f7fd9, 0xf5f5ef, 0xd63a5c],
    [0xe9e4d4, 0x7b3fa0, 0x2faa4e, 0x20252e, 0xee8a1d],
    [0xfafaf5, 0xb3202c, 0x1f6fb5, 0x111a24, 0x67b83e],
];

impl Setting {
    pub(super) fn new(seed: u64, ior: f64, mesh: Option<TriangleMesh>) -> Setting {
        let turn = if seed == 0 { 0.0 } else { TAU * unit(mix(seed, 99)) };
        Setting { ior, mesh, seed, turn }
    }

    /// Bits for what `salt` counts, from the seed of the scene.
    pub(super) fn salted(&self, salt: u64) -> u64 {
        mix(self.seed, salt)
    }

    /// A position of the surroundings, turned about the vertical axis by the seed.
    pub(super) fn at(&self, x: f64, y: f64, z: f64) -> Vec3<f64> {
        let (s, c) = self.turn.sin_cos();
        vec3(c * x - s * y, s * x + c * y, z)
    }

    /// A solid mosaic; `salt` chooses palette and pattern.
    pub(super) fn texture(&self, salt: u64, cell: f64) -> Texture {
        self.mosaic(&PALETTES[(salt % 4) as usize], salt, cell)
    }

    /// A solid mosaic of these display colours; `salt` chooses the pattern.
    pub(super) fn mosaic(&self, colors: &[u32], salt: u64, cell: f64) -> Texture {
        self.cells(colors, salt, Vec3::splat(cell))
    }

    /// The same with cells of three edge lengths.
    fn cells(&self, colors: &[u32], salt: u64, cell: Vec3<f64>) -> Texture {
        let palette = colors.iter().map(|&c| rgb(c)).collect();
        Texture::Mosaic(Mosaic { palette, cell, grain: 0.018, seed: mix(self.seed, salt) })
    }

    /// The ground, whose tiles do not depend on height.
    fn ground(&self, colors: &[u32], tile: f64) -> Body {
        let texture = self.cells(colors, 1000, vec3(tile, tile, f64::INFINITY));
        let shape = Shape::Rectangle(Rectangle { min: [-1.0, -1.0], max: [1.0, 1.0], z: GROUND });
        Body::opaque("ground", shape, texture)
    }

    /// The ring of objects.
    fn ring(&self) -> Vec<Body> {
        let upright = |x: f64, y: f64, top: Vec3<f64>, radius| {
            Shape::cylinder(self.at(x, y, GROUND).to_array(), top.to_array(), radius)
        };
        let pillar = upright(-0.74, -0.45, self.at(-0.74, -0.45, 0.05), 0.1);
        let post = upright(0.87, 0.14, self.at(0.84, 0.1, 0.0), 0.05);
        let marble = Shape::sphere(self.at(0.52, -0.74, -0.55).to_array(), 0.15);
        let mut all = self.rounded_things();
        all.extend([
            Body::opaque("post", post, self.texture(8, 0.08)),
            Body::opaque("pillar", pillar, self.texture(1, 0.13)),
            Body::opaque("tower", self.tower(), self.texture(2, 0.12)),
            Body::opaque("marble", marble, self.texture(3, 0.11)),
            Body::opaque("pyramid", self.pyramid(), self.texture(6, 0.12)),
        ]);
        all
    }

    fn rounded_things(&self) -> Vec<Body> {
        let (from, to) = (self.at(-0.5, 0.74, -0.62), self.at(-0.72, 0.5, 0.1));
        let stick = Primitive::Capsule { from, to, radius: 0.07 };
        let axis = self.at(0.35, 0.93, 0.0).normalized();
        let wheel = Primitive::Torus { center: self.at(0.06, 0.8, -0.49), axis, major: 0.15, minor: 0.055 };
        let hoop = Primitive::Torus { center: self.at(-0.36, -0.8, -0.5), axis, major: 0.16, minor: 0.035 };
        let up = vec3(0.0, 0.0, 1.0);
        let stone =
            Primitive::Disk { center: self.at(0.74, -0.18, -0.64), axis: up, disk: 0.1, radius: 0.06 };
        let body = |name, part, salt, cell| {
            Body::opaque(name, Shape::implicit(vec![part], 0.0), self.texture(salt, cell))
        };
        vec![
            body("stick", stick, 5, 0.1),
            body("wheel", wheel, 4, 0.09),
            body("hoop", hoop, 9, 0.08),
            body("stone", stone, 7, 0.09),
        ]
    }

    fn tower(&self) -> Shape {
        let side = |k: i32| {
            let a = f64::from(k) * TAU / 6.0 + 0.2;
            (self.at(a.cos(), a.sin(), 0.0), 0.11)
        };
        let ends = [(vec3(0.0, 0.0, -1.0), 0.42), (self.at(0.35, 0.1, 1.0), 0.36)];
        Shape::Polyhedron(Polyhedron::around(self.at(0.7, 0.48, GROUND + 0.42), (0..6).map(side).chain(ends)))
    }

    fn pyramid(&self) -> Shape {
        let side = |k: i32| {
            let a = f64::from(k) * TAU / 3.0 + 0.5;
            (self.at(a.cos(), a.sin(), 0.5), 0.1)
        };
        let base = [(vec3(0.0, 0.0, -1.0), 0.08)];
        Shape::Polyhedron(Polyhedron::around(
            self.at(-0.74, 0.08, GROUND + 0.08),
            (0..3).map(side).chain(base),
        ))
    }

    /// A scene on white with the ground, the ring and `bodies`.
    pub(super) fn scene(&self, bodies: Vec<Body>) -> Scene {
        let colors = [0xf4efe6, 0x1b3a57, 0xe0562b, 0x2f9e8f, 0xf2b632, 0x7d4fa8, 0x8fb339];
        self.on(self.ground(&colors, 0.14), bodies)
    }

    /// The same on a calm ground, for scenes with many objects of their own.
    pub(super) fn calm_scene(&self, bodies: Vec<Body>) -> Scene {
        self.on(self.calm_ground(), bodies)
    }

    fn calm_ground(&self) -> Body {
        self.ground(&[0xf1ecdf, 0x9db7c6, 0x54788f, 0xd8c49a], 0.22)
    }

    /// A scene on white with a calm ground and `bodies`, without the ring.
    pub(super) fn wide_scene(&self, bodies: Vec<Body>) -> Scene {
        let mut all = vec![self.calm_ground()];
        all.extend(bodies);
        self.bare(all)
    }

    fn on(&self, ground: Body, bodies: Vec<Body>) -> Scene {
        let mut all = vec![ground];
        all.extend(self.ring());
        all.extend(bodies);
        self.bare(all)
    }

    /// A scene on white of nothing but `bodies`.
    fn bare(&self, bodies: Vec<Body>) -> Scene {
        Scene {
            name: String::new(),
            shows: String::new(),
            bodies,
            environment: Environment::Constant([1.0; 3]),
            bounds: Scene::usual_bounds(),
            elevations: Elevations::UPPER,
        }
    }
}
