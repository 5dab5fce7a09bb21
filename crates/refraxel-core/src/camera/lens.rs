//! Lens models: normalised distorted image coordinates to a direction and back.

use crate::{Vec3, vec3};

/// How directions map to normalised image coordinates (pixel − centre) / focal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// (x/z, y/z), no distortion.
    Pinhole,
}

impl Lens {
    /// The (unnormalised) direction in the camera frame that the lens images at `distorted`.
    pub fn direction(&self, distorted: [f64; 2]) -> Option<Vec3<f64>> {
        match self {
            Lens::Pinhole => Some(vec3(distorted[0], distorted[1], 1.0)),
        }
    }

    /// Normalised distorted image coordinates of a point in the camera frame.
    pub fn project(&self, x: Vec3<f64>) -> Option<[f64; 2]> {
        match self {
            Lens::Pinhole => (x.z > 0.0).then(|| [x.x / x.z, x.y / x.z]),
        }
    }
}
