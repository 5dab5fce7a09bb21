//! Scenes of media whose index changes from place to place.

use super::super::medium::{Index, Medium};
use super::super::scene::{Body, Matter, Scene};
use super::super::shape::Shape;
use super::surroundings::{GROUND, MIDDLE, Setting};
use super::water::things;

pub(super) fn luneburg(s: &Setting) -> Scene {
    let index = Index::Luneburg { center: MIDDLE.into(), radius: 0.52 };
    s.scene(vec![Body::refractive("lens", Shape::sphere(MIDDLE, 0.52), Medium::graded(index), 1)])
}

pub(super) fn fish_eye(s: &Setting) -> Scene {
    let index = Index::FishEye { center: MIDDLE.into(), radius: 0.5 };
    s.scene(vec![Body::refractive("lens", Shape::sphere(MIDDLE, 0.5), Medium::graded(index), 1)])
}

/// Index contrast that counts as the object in masks.
const VISIBLE_CONTRAST: f64 = 0.02;

pub(super) fn gaussian_bump(s: &Setting) -> Scene {
    let sigma = 0.15;
    let index = Index::Gaussian { center: MIDDLE.into(), sigma, peak: s.ior };
    // At 6.6 σ the contrast is below 1e-9: rays enter the region without noticing.
    let region = Shape::sphere(MIDDLE, 6.6 * sigma);
    let contrast = (s.ior - 1.0).abs() / VISIBLE_CONTRAST;
    let visible = Shape::sphere(MIDDLE, sigma * (2.0 * contrast.max(1.0).ln()).sqrt());
    let medium = Medium::graded(index);
    let matter = Matter::Refractive { medium, priority: 1, visible: Some(visible) };
    s.scene(vec![Body { name: "bump".into(), shape: region, matter }])
}

pub(super) fn sugar_water(s: &Setting) -> Scene {
    let index = Index::Layered { z_bottom: GROUND, z_top: 0.0, bottom: 1.5, top: 1.34 };
    let block = Shape::cuboid([-0.55, -0.55, GROUND - 0.05], [0.55, 0.55, 0.0]);
    let mut bodies = things(s, GROUND);
    bodies.push(Body::refractive("sugar water", block, Medium::graded(index), 1));
    s.calm_scene(bodies)
}
