//! A flat piece of ground.

use super::crossing::{Crossing, S_MIN};
use refraxel_core::{Ray, vec3};
use serde::{Deserialize, Serialize};

/// A horizontal rectangle at height `z`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rectangle {
    /// Smallest (x, y) [scene unit].
    pub min: [f64; 2],
    /// Largest (x, y) [scene unit].
    pub max: [f64; 2],
    /// Height [scene unit].
    pub z: f64,
}

impl Rectangle {
    pub(super) fn hit(&self, ray: &Ray<f64>, s_max: f64) -> Option<Crossing> {
        let s = (self.z - ray.origin.z) / ray.direction.z;
        let x = ray.at(s);
        let within = x.x >= self.min[0] && x.x <= self.max[0] && x.y >= self.min[1] && x.y <= self.max[1];
        (s > S_MIN && s < s_max && within).then_some(Crossing { s, normal: vec3(0.0, 0.0, 1.0) })
    }
}
