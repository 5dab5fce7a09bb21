//! What stands on the tables.

use super::decor::{Decor, stripes};
use crate::synth::medium::Medium;
use crate::synth::scene::Body;
use crate::synth::scenes::sharp::{UP, glass, stone_around, vase};
use crate::synth::scenes::surroundings::{GROUND, Setting};
use crate::synth::scenes::water::{Tumbler, pool};
use crate::synth::shape::{Polyhedron, Primitive, Shape};
use crate::synth::texture::{Face, Paint, Texture, rgb};
use refraxel_core::vec3;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

pub(super) fn bear(s: &Setting, _: &Decor) -> Vec<Body> {
    let ball = |x: f64, y: f64, z: f64, radius| Primitive::Sphere { center: vec3(x, y, z), radius };
    let limb = |from, to, radius| Primitive::Capsule { from, to, radius };
    let mut parts =
        vec![ball(0.0, 0.05, -0.38, 0.3), ball(0.0, 0.0, 0.06, 0.21), ball(0.0, -0.19, 0.0, 0.08)];
    for side in [-1.0, 1.0] {
        parts.push(ball(side * 0.17, 0.04, 0.24, 0.075));
        parts.push(limb(vec3(side * 0.22, -0.02, -0.2), vec3(side * 0.36, -0.2, -0.32), 0.08));
        parts.push(limb(vec3(side * 0.18, -0.05, -0.58), vec3(side * 0.24, -0.3, -0.585), 0.1));
    }
    vec![glass(s, Shape::implicit(parts, 0.09))]
}

pub(super) fn vessel(s: &Setting, _: &Decor) -> Vec<Body> {
    let tumbler = Tumbler { radius: 0.27, wall: 0.025, base: GROUND + 0.08, rim: 0.5, level: 0.1 };
    tumbler.bodies(s.ior).into()
}

pub(super) fn marbles(s: &Setting, _: &Decor) -> Vec<Body> {
    const R: f64 = 0.2;
    let low = [[-R, -R], [R, -R], [R, R], [-R, R]].map(|[x, y]| [x, y, GROUND + 0.005 + R]);
    let top = [0.0, 0.0, GROUND + 0.005 + R + 2.0 * R * FRAC_1_SQRT_2];
    low.into_iter().chain([top]).map(|center| glass(s, Shape::sphere(center, R))).collect()
}

pub(super) fn stone(s: &Setting, _: &Decor) -> Vec<Body> {
    vec![glass(s, stone_around(vec3(0.02, -0.03, GROUND + 0.44)))]
}

/// A closed bottle: glass with a cavity of the same form, the wall thinner.
pub(super) fn bottle(s: &Setting, _: &Decor) -> Vec<Body> {
    let form = |wall: f64| {
        let upright = |low: f64, high: f64, radius: f64| Primitive::Capsule {
            from: vec3(0.0, 0.0, low),
            to: vec3(0.0, 0.0, high),
            radius: radius - wall,
        };
        Shape::implicit(vec![upright(-0.36, -0.2, 0.33), upright(0.0, 0.35, 0.12)], 0.16)
    };
    vec![glass(s, form(0.0)), Body::refractive("air", form(0.045), Medium::clear(1.0), 2)]
}

pub(super) fn hidden(s: &Setting, d: &Decor) -> Vec<Body> {
    let pencil = Shape::cylinder([-0.75, -0.5, GROUND + 0.035], [0.1, -0.62, GROUND + 0.55], 0.03);
    let dots = s.texture(60, 0.1);
    vec![
        glass(s, Shape::sphere([0.0, 0.05, GROUND + 0.385], 0.38)),
        d.can(
            "cup",
            [0.38, -0.45],
            [GROUND, GROUND + 0.42],
            0.17,
            stripes(0.06, &[0xf4efe6, 0xb3202c, 0x1f6fb5]),
        ),
        d.block(
            "book",
            [-0.75, -0.42, GROUND],
            [-0.62, 0.2, GROUND + 0.6],
            d.print(70, 0.1, [0x23395b, 0xf2d8a0]),
        ),
        d.block(
            "book",
            [-0.6, -0.55, GROUND],
            [-0.15, -0.42, GROUND + 0.3],
            d.print(71, 0.07, [0xd9a441, 0x2a2a2a]),
        ),
        Body::opaque("pencil", pencil, dots),
    ]
}

pub(super) fn ball(s: &Setting, _: &Decor) -> Vec<Body> {
    vec![glass(s, Shape::sphere([0.0, 0.0, GROUND + 0.445], 0.44))]
}

/// A ball against a side of an upright crystal with six sides and a point: they touch in one point.
pub(super) fn pair(s: &Setting, _: &Decor) -> Vec<Body> {
    const SIDE: f64 = 0.24;
    const R: f64 = 0.28;
    let center = vec3(0.24, 0.06, GROUND + 0.4);
    let towards = |k: u32| {
        let a = f64::from(k) * TAU / 6.0 + 0.35;
        vec3(a.cos(), a.sin(), 0.0)
    };
    let sides = (0..6).flat_map(|k| [(towards(k), SIDE), (towards(k) * 0.8 + UP * 0.6, 0.36)]);
    let crystal = Polyhedron::around(center, sides.chain([(-UP, 0.395)]));
    let at = center + towards(3) * (SIDE + R);
    let ball = Shape::sphere([at.x, at.y, GROUND + 0.005 + R], R);
    vec![glass(s, ball), glass(s, Shape::Polyhedron(crystal))]
}

pub(super) fn basin(s: &Setting, _: &Decor) -> Vec<Body> {
    pool(s)
}

/// Index of a clearcoat that reflects 99.6 % of the light: a mirror.
const MIRROR: f64 = 1000.0;
/// Index of one that reflects 60 %: metal.
const METAL: f64 = 8.0;

pub(super) fn mirrors(s: &Setting, d: &Decor) -> Vec<Body> {
    let plain = |hex| Texture::Plain(rgb(hex));
    let can = Shape::cylinder([0.5, -0.35, GROUND], [0.5, -0.35, GROUND + 0.55], 0.17);
    let bowl =
        Primitive::Disk { center: vec3(-0.1, -0.58, GROUND + 0.09), axis: UP, disk: 0.12, radius: 0.085 };
    vec![
        Body::glazed("mirror ball", Shape::sphere([-0.1, 0.1, GROUND + 0.405], 0.4), plain(0x000000), MIRROR),
        Body::glazed("steel", can, plain(0x3a3d40), METAL),
        Body::glazed("brass", Shape::implicit(vec![bowl], 0.0), plain(0x8a6a20), METAL),
        Body::glazed("vase", vase([-0.68, -0.2], 0.6), plain(0x1b2a41), 1.5),
        Body::glazed("marble", Shape::sphere([0.62, 0.35, GROUND + 0.15], 0.15), s.texture(61, 0.08), 1.5),
        d.ball("ball", [0.3, 0.62, GROUND + 0.17], 0.17, d.motifs(72, 0.1, &[0xf2b632, 0x2f9e8f, 0xf4efe6])),
    ]
}

pub(super) fn opaque(s: &Setting, d: &Decor) -> Vec<Body> {
    let jug = vase([0.05, 0.1], 1.0);
    let round = d.texture(
        Face::Round { center: vec3(0.05, 0.1, -0.2), radius: 0.3, half: f64::INFINITY },
        d.motifs(73, 0.13, &[0xf1ead6, 0x2b5f8a, 0x1b3a57]),
    );
    let banana = Primitive::Capsule {
        from: vec3(-0.55, -0.45, GROUND + 0.08),
        to: vec3(-0.2, -0.6, GROUND + 0.08),
        radius: 0.075,
    };
    vec![
        Body::opaque("jug", jug, round),
        d.ball(
            "apple",
            [0.5, -0.3, GROUND + 0.17],
            0.17,
            d.speckle(74, 0.2, &[0x5f8a2f, 0x8fae3f, 0xc9c95a]),
        ),
        d.ball("orange", [0.25, -0.55, GROUND + 0.15], 0.15, d.speckle(75, 0.08, &[0xd97a1f, 0xf2a03a])),
        Body::opaque("banana", Shape::implicit(vec![banana], 0.0), s.texture(62, 0.09)),
        d.block(
            "tea",
            [-0.62, 0.0, GROUND],
            [-0.32, 0.3, GROUND + 0.46],
            d.print(76, 0.08, [0x7a1f2b, 0xf3e3b8]),
        ),
        d.block(
            "board",
            [0.4, 0.3, GROUND],
            [0.8, 0.62, GROUND + 0.2],
            Paint::Books { shelf: 0.2, seed: d.seed(77) },
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::Vec3;

    #[test]
    fn marbles_touch_without_overlap() {
        let setting = Setting::new(0, 1.5, None);
        let decor = Decor::new(&setting, Vec3::zero(), 1.0, 0.3);
        let centers: Vec<Vec3<f64>> =
            marbles(&setting, &decor).iter().map(|b| b.shape.bounds().center()).collect();
        let apart = |i: usize, j: usize| (centers[i] - centers[j]).length();
        for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0), (4, 0), (4, 1), (4, 2), (4, 3)] {
            assert!((apart(i, j) - 0.4).abs() < 1e-9, "{i} {j}: {}", apart(i, j));
        }
    }
}
