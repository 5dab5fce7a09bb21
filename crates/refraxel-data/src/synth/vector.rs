//! How vectors are written in `scene.json`: `[x, y, z]`.

use refraxel_core::Vec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(super) fn serialize<S: Serializer>(v: &Vec3<f64>, s: S) -> Result<S::Ok, S::Error> {
    v.to_array().serialize(s)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec3<f64>, D::Error> {
    <[f64; 3]>::deserialize(d).map(Vec3::from)
}

/// The same for a list of vectors.
pub(super) mod list {
    use super::*;

    pub(in crate::synth) fn serialize<S: Serializer>(v: &[Vec3<f64>], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(v.iter().map(|x| x.to_array()))
    }

    pub(in crate::synth) fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<Vec3<f64>>, D::Error> {
        Ok(Vec::<[f64; 3]>::deserialize(d)?.into_iter().map(Vec3::from).collect())
    }
}
