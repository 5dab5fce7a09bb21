//! A camera with its pose: pixels of its picture to rays in the world, and back.

use super::lens::Lens;
use crate::{Mat3, Ray, Vec3};

/// A rigid motion `x_world = rotation * x_camera + translation`, theory (1.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// R of theory (1.1). Its columns are the axes of the camera (right, down, forward) in the world.
    pub rotation: Mat3<f64>,
    /// o of theory (1.1), the centre of the camera in the world [scene unit].
    pub translation: Vec3<f64>,
}

/// A posed camera with its lens. Always in double precision: rays are cast to the renderer's precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Image width [pixel].
    pub width: u32,
    /// Image height [pixel].
    pub height: u32,
    /// Focal lengths (fx, fy) [pixel].
    pub focal: [f64; 2],
    /// Principal point (cx, cy) [pixel]; the middle of an image is (W/2, H/2).
    pub center: [f64; 2],
    /// Projection and distortion of the lens.
    pub lens: Lens,
    /// The pose: maps the camera frame to the world.
    pub world_from_camera: Pose,
}

impl Camera {
    /// The ray through continuous pixel coordinates `(u, v)` [pixel], theory (1.2) and (1.3); `None` where the lens
    /// maps no direction there (beyond the fold of a distortion polynomial, or outside a fisheye's image circle).
    pub fn ray(&self, u: f64, v: f64) -> Option<Ray<f64>> {
        let (d, pose) = (self.direction(u, v)?, &self.world_from_camera);
        Some(Ray { origin: pose.translation, direction: (pose.rotation * d).normalized() })
    }

    /// The direction of this ray in the camera frame, of any length.
    pub fn direction(&self, u: f64, v: f64) -> Option<Vec3<f64>> {
        self.lens.direction([(u - self.center[0]) / self.focal[0], (v - self.center[1]) / self.focal[1]])
    }

    /// Continuous pixel coordinates [pixel] of a world point, the inverse of [`Self::ray`]; `None` behind a
    /// perspective camera or beyond the lens.
    pub fn project(&self, x: Vec3<f64>) -> Option<[f64; 2]> {
        Some(self.pixel(self.lens.project(self.seen(x))?))
    }

    /// [`Self::project`] of a point that the picture shows, edges included; `None` for all others, which takes less time than to project
    /// them.
    pub fn project_into(&self, x: Vec3<f64>) -> Option<[f64; 2]> {
        let size = [self.width, self.height].map(f64::from);
        let is_shown = |at| {
            let pixel = self.pixel(at);
            (0..2).all(|a| pixel[a] >= 0.0 && pixel[a] <= size[a])
        };
        Some(self.pixel(self.lens.project_where(self.seen(x), is_shown)?))
    }

    /// A world point in the camera frame.
    fn seen(&self, x: Vec3<f64>) -> Vec3<f64> {
        let pose = &self.world_from_camera;
        pose.rotation.transpose() * (x - pose.translation)
    }

    /// Pixel coordinates of normalised coordinates.
    fn pixel(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|a| at[a] * self.focal[a] + self.center[a])
    }

    /// Whether two cameras differ in nothing but where they are.
    pub fn has_lens_of(&self, other: &Camera) -> bool {
        Camera { world_from_camera: other.world_from_camera, ..*self } == *other
    }

    /// Unit direction of the optical axis in the world, away from the camera.
    pub fn forward(&self) -> Vec3<f64> {
        self.world_from_camera.rotation.columns[2]
    }

    /// The same camera for an image resized to `width` × `height` [pixel]: focal lengths and principal point scale along
    /// each axis.
    pub fn resized(&self, width: u32, height: u32) -> Camera {
        let s = [f64::from(width) / f64::from(self.width), f64::from(height) / f64::from(self.height)];
        Camera {
            width,
            height,
            focal: [self.focal[0] * s[0], self.focal[1] * s[1]],
            center: [self.center[0] * s[0], self.center[1] * s[1]],
            ..*self
        }
    }

    /// A pinhole camera at `eye` looking at `target`, with `up` roughly upwards in the image and the full
    /// horizontal field of view in radians.
    pub fn look_at(eye: Vec3<f64>, target: Vec3<f64>, up: Vec3<f64>, fov_x: f64, size: [u32; 2]) -> Camera {
        let forward = (target - eye).normalized();
        let right = forward.cross(up).normalized();
        let down = forward.cross(right);
        let f = 0.5 * f64::from(size[0]) / (0.5 * fov_x).tan();
        Camera {
            width: size[0],
            height: size[1],
            focal: [f, f],
            center: [0.5 * f64::from(size[0]), 0.5 * f64::from(size[1])],
            lens: Lens::Pinhole,
            world_from_camera: Pose { rotation: Mat3 { columns: [right, down, forward] }, translation: eye },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vec3;

    #[test]
    fn projecting_a_point_of_a_ray_gives_back_its_pixel() {
        let camera =
            Camera::look_at(vec3(2.0, -3.0, 1.0), vec3(0.1, 0.0, 0.2), vec3(0.0, 0.0, 1.0), 0.7, [200, 150]);
        for (u, v) in [(0.5, 0.5), (100.0, 75.0), (199.5, 3.25)] {
            let ray = camera.ray(u, v).unwrap();
            let [pu, pv] = camera.project(ray.at(3.7)).unwrap();
            assert!((pu - u).abs() < 1e-9 && (pv - v).abs() < 1e-9);
        }
        assert!(camera.project(vec3(4.0, -6.0, 1.8)).is_none(), "a point behind the camera has no pixel");
    }

    #[test]
    fn points_that_the_picture_shows_are_projected_as_all_are() {
        let lenses = [
            Lens::Pinhole,
            Lens::OpenCv { k: [-0.3, 0.05, 0.0, 0.0], p: [0.001, -0.002] },
            Lens::Fisheye { k: [-0.02, 0.004, -0.002, 0.0003] },
            Lens::Fov { omega: 0.9 },
            Lens::Equirectangular,
        ];
        let middle =
            Camera::look_at(vec3(0.0, -3.0, 0.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.9, [200, 150]);
        for lens in lenses {
            let camera = Camera { lens, ..middle };
            let (mut shown, mut beside) = (0, 0);
            for k in 0..2000 {
                let at = |i: i32| 6.0 * (f64::from(k) * 1.220_744_084_605_76_f64.powi(-i)).fract() - 3.0;
                let x = vec3(at(1), at(2), at(3));
                let is_shown = |[u, v]: &[f64; 2]| (0.0..=200.0).contains(u) && (0.0..=150.0).contains(v);
                let all = camera.project(x).filter(is_shown);
                assert_eq!(camera.project_into(x), all, "{lens:?} at {x:?}");
                *(if all.is_some() { &mut shown } else { &mut beside }) += 1;
            }
            assert!(shown > 100 && beside > 100, "{lens:?}: {shown} and {beside}");
        }
    }

    #[test]
    fn up_is_towards_row_zero() {
        let camera =
            Camera::look_at(vec3(3.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), 0.7, [100, 100]);
        assert!(camera.project(vec3(0.0, 0.0, 0.5)).unwrap()[1] < 50.0);
        assert!(camera.project(vec3(0.0, 0.5, 0.0)).unwrap()[0] > 50.0);
    }
}
