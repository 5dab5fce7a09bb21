//! What a phone, the estimation of its poses and a segmenter do to exact pictures.
//!
//! Each imperfection can be left out, and draws its own random numbers: without it, the others stay as they are. All of
//! them depend on seed and view only, never on the order in which views are made.

mod imperfection;
mod pose;
mod sensor;
mod silhouette;

pub use imperfection::{Imperfection, Imperfections, UnknownImperfection};
pub use pose::{POSITION_ERROR, TURN_ERROR};
pub use sensor::{EXPOSURE, JPEG_QUALITY, READ_NOISE, WHITE_ELECTRONS};
pub use silhouette::WANDER;

pub(super) use pose::estimated;
pub(super) use sensor::{Sensor, developed};
pub(super) use silhouette::{MaskOf, drawn, mask_of, seen};

use super::hash::{mix, unit};
use super::render::ThinLens;
use refraxel_core::{Camera, Vec3};

/// Radius of the lens as a share of the distance at which it is in focus: a far point becomes a disc of 0.34°.
pub const LENS_RADIUS: f64 = 0.003;

/// The lens of a camera that is focused on `target`.
pub(super) fn lens_of(camera: &Camera, target: Vec3<f64>) -> ThinLens {
    let focus = (target - camera.world_from_camera.translation).dot(camera.forward());
    ThinLens { radius: LENS_RADIUS * focus, focus }
}

/// A number in [−1, 1), the same for the same arguments.
fn signed(seed: u64, draw: u64) -> f64 {
    2.0 * unit(mix(seed, draw)) - 1.0
}
