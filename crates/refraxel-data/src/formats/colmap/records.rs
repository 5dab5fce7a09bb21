//! What the files of a model list: images, points and cameras.

use super::models::Calibration;
use refraxel_core::Vec3;
use std::collections::HashMap;

/// One registered image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Image {
    /// Line or image id, for messages.
    pub(super) key: String,
    /// World-to-camera rotation (w, x, y, z).
    pub(super) quaternion: [f64; 4],
    /// World-to-camera translation.
    pub(super) translation: [f64; 3],
    pub(super) camera: u32,
    /// Path below the image folder.
    pub(super) name: String,
}

/// One triangulated point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) position: Vec3<f64>,
    /// Mean distance between where the point is seen and where it is projected [pixel], where it is stated.
    pub(super) error: Option<f64>,
}

pub(super) type Calibrations = HashMap<u32, Calibration>;
