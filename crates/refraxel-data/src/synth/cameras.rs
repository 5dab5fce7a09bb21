//! Where the pictures are taken from.

use super::elevations::Elevations;
use super::hash::{mix, unit};
use super::scene::Scene;
use refraxel_core::{Camera, Vec3, vec3};
use std::f64::consts::TAU;

/// Full horizontal field of view [rad], that of the NeRF-synthetic scenes.
pub const CAMERA_ANGLE_X: f64 = 0.6911112070083618;
/// Distance of every camera from the origin [scene unit].
pub const CAMERA_RADIUS: f64 = 4.0;

/// From which directions a scene is seen; all cameras look at the middle of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraSet {
    /// From above the ground, [`Scene::elevations`](super::Scene::elevations): in most scenes 12° to 78°.
    Upper,
    /// All directions but those within 12° of straight up or down.
    Full,
}

impl CameraSet {
    /// The elevations of the cameras around a scene.
    pub fn elevations(self, scene: &Scene) -> Elevations {
        match self {
            CameraSet::Upper => scene.elevations,
            CameraSet::Full => Elevations::FULL,
        }
    }
}

/// Places around the origin from which pictures are taken, and what they are directed at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoints {
    /// How far above the horizontal plane.
    pub elevations: Elevations,
    /// From and to which angle from the x axis towards the y axis [rad].
    pub azimuths: [f64; 2],
    /// Least and largest distance from the origin [scene unit].
    pub distances: [f64; 2],
    /// What is in the middle of every picture [scene unit].
    pub target: Vec3<f64>,
    /// Full horizontal field of view [rad].
    pub angle_x: f64,
}

impl Viewpoints {
    /// Those of the scenes without a room.
    fn around(elevations: Elevations) -> Viewpoints {
        Viewpoints {
            elevations,
            azimuths: [0.0, TAU],
            distances: [CAMERA_RADIUS; 2],
            target: vec3(0.0, 0.0, -0.12),
            angle_x: CAMERA_ANGLE_X,
        }
    }

    /// `count` cameras that cover the viewpoints evenly; so does every prefix of them.
    ///
    /// Directions follow the additive recurrence with the inverse powers of the plastic number (Roberts 2018) in
    /// (sin elevation, azimuth), shifted by `seed`: equal areas of the sphere get equally many cameras.
    pub fn cameras(&self, count: usize, seed: u64, size: [u32; 2]) -> Vec<Camera> {
        const PLASTIC: f64 = 1.324_717_957_244_746;
        let between = |[from, to]: [f64; 2], share: f64| from + (to - from) * share;
        let heights = [self.elevations.low.sin(), self.elevations.high.sin()];
        let shift = [unit(mix(seed, 1)), unit(mix(seed, 2))];
        (0..count)
            .map(|i| {
                let t = (i + 1) as f64;
                let z = between(heights, (shift[0] + t / PLASTIC).fract());
                let azimuth = between(self.azimuths, (shift[1] + t / (PLASTIC * PLASTIC)).fract());
                let rho = (1.0 - z * z).sqrt();
                let distance = between(self.distances, unit(mix(seed, 3 + i as u64)));
                let eye = vec3(rho * azimuth.cos(), rho * azimuth.sin(), z) * distance;
                Camera::look_at(eye, self.target, vec3(0.0, 0.0, 1.0), self.angle_x, size)
            })
            .collect()
    }
}

/// `count` cameras around a scene without a room, see [`Viewpoints::cameras`].
pub fn cameras(range: Elevations, count: usize, seed: u64, size: [u32; 2]) -> Vec<Camera> {
    Viewpoints::around(range).cameras(count, seed, size)
}

/// Camera-to-world matrix in the axes of OpenGL (x right, y up, z backwards), row by row, as NeRF-synthetic stores it.
pub fn opengl_matrix(camera: &Camera) -> [[f64; 4]; 4] {
    let pose = &camera.world_from_camera;
    let [right, down, forward] = pose.rotation.columns;
    let row = |a: usize| [right[a], -down[a], -forward[a], pose.translation[a]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// The pinhole camera of an OpenGL camera-to-world matrix, the inverse of [`opengl_matrix`].
pub fn from_opengl_matrix(m: [[f64; 4]; 4], angle_x: f64, size: [u32; 2]) -> Camera {
    let column = |c: usize| Vec3::from([m[0][c], m[1][c], m[2][c]]);
    let mut camera = Camera::look_at(column(3), column(3) - column(2), column(1), angle_x, size);
    camera.world_from_camera.rotation.columns = [column(0), -column(1), -column(2)];
    camera
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_stand_at_the_stated_distance_within_the_stated_elevations() {
        for c in cameras(Elevations::UPPER, 50, 3, [20, 10]) {
            let eye = c.world_from_camera.translation;
            assert!((eye.length() - CAMERA_RADIUS).abs() < 1e-12);
            assert!((12.0..=78.0).contains(&(eye.z / CAMERA_RADIUS).asin().to_degrees()));
        }
        let full = cameras(Elevations::FULL, 50, 3, [20, 10]);
        assert!(full.iter().filter(|c| c.world_from_camera.translation.z < 0.0).count() > 15);
    }

    #[test]
    fn the_matrix_of_a_camera_gives_the_camera_back() {
        let camera = cameras(Elevations::UPPER, 3, 1, [200, 100])[2];
        let back = from_opengl_matrix(opengl_matrix(&camera), CAMERA_ANGLE_X, [200, 100]);
        assert_eq!(back, camera);
    }
}
