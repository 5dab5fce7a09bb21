//! The camera of a page, and that of the renderer.

use refraxel_core::{Camera, Lens, Mat3, Pose, Vec3, vec3};
use serde::{Deserialize, Serialize};

/// Largest edge of a picture that a page may ask for [pixel].
pub const LARGEST: u32 = 2048;
/// Smallest edge [pixel].
const SMALLEST: u32 = 16;
/// Fields of view that a page may ask for [rad].
const ANGLES: [f64; 2] = [0.01, 2.8];

/// A camera of a page.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(deny_unknown_fields)]
pub struct PageCamera {
    /// Where it is [scene unit].
    pub eye: [f64; 3],
    /// Its axes to the right, downwards and forward.
    pub axes: [[f64; 3]; 3],
    /// Horizontal field of view [rad].
    pub angle: f64,
    /// Width and height of the picture [pixel].
    pub size: [u32; 2],
}

impl PageCamera {
    /// The same camera for the renderer; an error says which number makes no sense.
    pub fn camera(&self) -> Result<Camera, String> {
        let Self { eye, axes, angle, size } = *self;
        if let Some(edge) = size.iter().find(|n| !(SMALLEST..=LARGEST).contains(n)) {
            return Err(format!("camera.size: found {edge}; expected {SMALLEST} to {LARGEST} pixels"));
        }
        if !(ANGLES[0]..=ANGLES[1]).contains(&angle) {
            let [low, high] = ANGLES;
            return Err(format!("camera.angle: found {angle}; expected {low} to {high} rad"));
        }
        if !eye.iter().all(|x| x.abs() < 1e9) {
            return Err("camera.eye: expected finite numbers".to_owned());
        }
        let rotation = right_handed(axes.map(|[x, y, z]| vec3(x, y, z)))
            .ok_or("camera.axes: expected the axes to the right, downwards and forward, of unit length")?;
        let focal = 0.5 * f64::from(size[0]) / (0.5 * angle).tan();
        let translation = vec3(eye[0], eye[1], eye[2]);
        Ok(Camera {
            width: size[0],
            height: size[1],
            focal: [focal; 2],
            center: size.map(|n| 0.5 * f64::from(n)),
            lens: Lens::Pinhole,
            world_from_camera: Pose { rotation, translation },
        })
    }

    /// The camera of a page that is where this one is and sees as much from left to right.
    pub fn of(camera: &Camera) -> Self {
        let Pose { rotation, translation } = camera.world_from_camera;
        let angle = 2.0 * (0.5 * f64::from(camera.width) / camera.focal[0]).atan();
        Self {
            eye: translation.to_array(),
            axes: rotation.columns.map(|c| c.to_array()),
            angle: angle.clamp(ANGLES[0], ANGLES[1]),
            size: [camera.width, camera.height],
        }
    }
}

/// Axes that are nearly orthonormal, made so.
fn right_handed([right, down, forward]: [Vec3<f64>; 3]) -> Option<Mat3<f64>> {
    let near = |x: f64, y: f64| (x - y).abs() < 1e-3;
    let are_unit = [right, down, forward].iter().all(|a| near(a.length(), 1.0));
    if !are_unit || !near(right.dot(forward), 0.0) || !near(forward.cross(right).dot(down), 1.0) {
        return None;
    }
    let forward = forward.normalized();
    let right = (right - forward * right.dot(forward)).normalized();
    Some(Mat3 { columns: [right, forward.cross(right), forward] })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page() -> PageCamera {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        PageCamera { eye: [0.0; 3], axes, angle: 0.7, size: [40, 30] }
    }

    #[test]
    fn a_camera_that_goes_to_the_page_and_back_is_the_same() {
        let eye = vec3(2.0, -3.0, 1.0);
        let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [40, 30]);
        let back = PageCamera::of(&camera).camera().unwrap();
        let (a, b) = (camera.ray(3.0, 4.0).unwrap(), back.ray(3.0, 4.0).unwrap());
        assert!((a.direction - b.direction).length() < 1e-12 && a.origin == b.origin);
    }

    #[test]
    fn cameras_that_make_no_sense_are_refused_by_name() {
        let refused = |page: PageCamera, name: &str| {
            let why = page.camera().unwrap_err();
            assert!(why.starts_with(name), "{why}");
        };
        refused(PageCamera { size: [1, 30], ..page() }, "camera.size");
        refused(PageCamera { size: [40, 100_000], ..page() }, "camera.size");
        refused(PageCamera { angle: f64::NAN, ..page() }, "camera.angle");
        refused(PageCamera { eye: [f64::INFINITY, 0.0, 0.0], ..page() }, "camera.eye");
        refused(PageCamera { axes: [[0.0; 3]; 3], ..page() }, "camera.axes");
        let mirrored = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        refused(PageCamera { axes: mirrored, ..page() }, "camera.axes");
    }
}
