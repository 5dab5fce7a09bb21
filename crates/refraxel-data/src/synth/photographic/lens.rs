//! The lens, which is sharp at one distance only.

use crate::synth::render::ThinLens;
use refraxel_core::{Camera, Vec3};

/// Radius of the lens as a share of the distance at which it is in focus: a far point becomes a disc of 0.34°.
pub const LENS_RADIUS: f64 = 0.003;

/// The lens of a camera that is focused on `target`.
pub(in crate::synth) fn lens_of(camera: &Camera, target: Vec3<f64>) -> ThinLens {
    let focus = (target - camera.world_from_camera.translation).dot(camera.forward());
    ThinLens { radius: LENS_RADIUS * focus, focus }
}
