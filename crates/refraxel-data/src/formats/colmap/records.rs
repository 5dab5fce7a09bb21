//! What the files of a model list: images, points and cameras.

use super::models::Calibration;
use refraxel_core::Vec3;
use std::collections::HashMap;

/// One registered image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Image {
    /// By which tracks name it.
    pub(super) id: u32,
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

/// The images of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Images {
    pub(super) all: Vec<Image>,
    /// Where their file contradicts itself.
    pub(super) doubts: Vec<String>,
}

/// One triangulated point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) position: Vec3<f64>,
    /// Mean distance between where the point is seen and where it is projected [pixel], where it is stated.
    pub(super) error: Option<f64>,
    /// Mean colour of its observations, where it is stated.
    pub(super) colour: Option<[u8; 3]>,
    /// Those of the images that were asked for that show it.
    pub(super) seen_by: Vec<u32>,
}

pub(super) type Calibrations = HashMap<u32, Calibration>;
