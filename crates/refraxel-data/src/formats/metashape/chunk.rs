//! From the coordinates of a chunk to those of the user: the transform of a chunk or of a component of it.

use super::element::{Element, child};
use crate::DataError;
use refraxel_core::{Mat3, Pose, Vec3};
use roxmltree::Node;
use std::path::Path;

/// Distances from the centre of the earth that its surface has [m].
const EARTH: std::ops::Range<f64> = 6.3e6..6.4e6;

/// A similarity: p ↦ scale · rotation · p + translation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Similarity {
    scale: f64,
    rotation: Mat3<f64>,
    translation: Vec3<f64>,
}

impl Similarity {
    /// The `<transform>` of a chunk or component; nothing changes where there is none.
    pub fn of(path: &Path, place: &str, node: Node) -> Result<Self, DataError> {
        let same = Self { scale: 1.0, rotation: Mat3::identity(), translation: Vec3::zero() };
        let Some(node) = child(node, "transform") else { return Ok(same) };
        let transform = Element { path, place, node };
        let rotation = transform.numbers::<9>("rotation", "nine finite numbers, row by row")?;
        let rotation = rotation.map_or(same.rotation, |[a, b, c, d, e, f, g, h, i]| {
            Mat3::from_rows([[a, b, c], [d, e, f], [g, h, i]])
        });
        let translation = transform.numbers::<3>("translation", "three finite numbers")?;
        let translation = translation.map_or(same.translation, Vec3::from);
        let scale = transform.numbers::<1>("scale", "a number > 0")?.map_or(1.0, |[s]| s);
        if scale <= 0.0 {
            return Err(transform.wrong("scale", &scale.to_string(), "a number > 0"));
        }
        Ok(Self { scale, rotation, translation })
    }

    /// The pose of a camera in the user's coordinates.
    pub fn apply(&self, pose: &Pose) -> Pose {
        Pose {
            rotation: self.rotation * pose.rotation,
            translation: self.rotation * pose.translation * self.scale + self.translation,
        }
    }

    /// Away from the centre of the earth, where coordinates are counted from there.
    pub fn up_on_earth(&self) -> Option<Vec3<f64>> {
        let distance = self.translation.length();
        EARTH.contains(&distance).then(|| self.translation / distance)
    }

    /// The same without the way to the centre of the earth, which leaves no digits for the scene.
    pub fn near_by(self) -> Self {
        Self { translation: Vec3::zero(), ..self }
    }
}
