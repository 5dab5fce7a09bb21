//! Which way is up in the world of a run, and the rotation that turns it to +y.

use crate::exit::Failure;
use refraxel_core::{Vec3, vec3};
use refraxel_data::{Dataset, scene_region};

/// Upward direction of synthetic datasets in the layout of NeRF.
const NERF_SYNTHETIC: Vec3<f64> = vec3(0.0, 0.0, 1.0);

/// The upward direction of a world.
#[derive(Clone, Debug, PartialEq)]
pub struct Up {
    /// Unit vector in world coordinates.
    pub direction: Vec3<f64>,
    /// Why the direction is not that of the cameras, if it is not.
    pub note: Option<String>,
}

impl Up {
    /// What `render --orbit` goes around, the direction that was stated or the mean upward direction of the cameras; +z when the
    /// dataset is gone.
    pub fn estimate(data: Result<Dataset, Failure>) -> Self {
        match data {
            Ok(data) => {
                let note = data.up.map(|_| "as stated".to_owned());
                Self { direction: scene_region(&data).up, note }
            }
            Err(failure) => Self {
                direction: NERF_SYNTHETIC,
                note: Some(format!(
                    "the cameras of the dataset cannot be read, so z is taken as up, as in NeRF-synthetic data ({})",
                    failure.error,
                )),
            },
        }
    }

    /// The unit quaternion (x, y, z, w) of the shortest rotation that turns this direction to +y.
    ///
    /// With θ the angle between both and a the unit axis of their cross product: (a sin(θ/2), cos(θ/2)), where
    /// sin(θ/2) = |up − y| / 2 and cos(θ/2) = |up + y| / 2. Of the half turns that take −y to +y, the one about x.
    pub fn rotation_to_y(&self) -> [f64; 4] {
        let (up, y) = (self.direction, vec3(0.0, 1.0, 0.0));
        let cross = up.cross(y);
        let [sine, cosine] = [(up - y).length() / 2.0, (up + y).length() / 2.0];
        let axis = if cross.length() > 0.0 { cross.normalized() } else { vec3(1.0, 0.0, 0.0) };
        let v = axis * sine;
        [v.x, v.y, v.z, cosine]
    }

    /// A vector after this rotation: q v q*, by Rodrigues' formula for unit quaternions.
    pub fn turned_to_y(&self, v: Vec3<f64>) -> Vec3<f64> {
        let [x, y, z, w] = self.rotation_to_y();
        let q = vec3(x, y, z);
        let t = q.cross(v) * 2.0;
        v + t * w + q.cross(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exit::Exit;
    use std::f64::consts::FRAC_1_SQRT_2;

    fn up(x: f64, y: f64, z: f64) -> Up {
        Up { direction: vec3(x, y, z).normalized(), note: None }
    }

    #[test]
    fn rotations_of_the_axes_are_exact() {
        assert_eq!(up(0.0, 0.0, 1.0).rotation_to_y(), [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2]);
        assert_eq!(up(0.0, 1.0, 0.0).rotation_to_y(), [0.0, 0.0, 0.0, 1.0]);
        assert_eq!(up(0.0, -1.0, 0.0).rotation_to_y(), [1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn every_upward_direction_is_turned_to_y() {
        for up in [
            up(0.1, -0.7, 0.4),
            up(1.0, 0.0, 0.0),
            up(1e-9, -1.0, 0.0),
            up(0.0, -1.0, 1e-5),
            up(0.3, 1.0, 1e-7),
        ] {
            let q = up.rotation_to_y();
            let norm: f64 = q.iter().map(|v| v * v).sum();
            assert!((norm - 1.0).abs() < 1e-14, "{up:?}: {norm}");
            let off = (up.turned_to_y(up.direction) - vec3(0.0, 1.0, 0.0)).length();
            assert!(off < 1e-14, "{up:?}: {off}");
        }
    }

    #[test]
    fn without_the_dataset_z_is_up_and_that_is_said() {
        let gone = Exit::BadInput.because("/data: no such file or folder");
        let up = Up::estimate(Err(gone));
        assert_eq!(up.direction, NERF_SYNTHETIC);
        assert!(up.note.unwrap().contains("/data: no such file"));
    }
}
