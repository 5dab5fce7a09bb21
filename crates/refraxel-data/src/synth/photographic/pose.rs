//! Poses as they are estimated from photographs: a little off.

use crate::synth::hash::signed;
use refraxel_core::{Camera, Mat3, Vec3, vec3};
use std::f64::consts::PI;

/// Angle by which every camera is turned away from its true pose [degree].
pub const TURN_ERROR: f64 = 0.06;
/// Distance by which every camera is moved, as a share of its distance from the thing.
pub const POSITION_ERROR: f64 = 0.001;

/// The camera that is told of one that took a picture of `target`: turned about a random axis, moved in a random direction.
pub(in crate::synth) fn estimated(camera: &Camera, target: Vec3<f64>, seed: u64) -> Camera {
    let mut told = *camera;
    let pose = &mut told.world_from_camera;
    let distance = (pose.translation - target).length();
    pose.rotation = Mat3::turning(direction(seed, 0) * TURN_ERROR.to_radians()) * pose.rotation;
    pose.translation += direction(seed, 2) * (POSITION_ERROR * distance);
    told
}

/// A direction, evenly over the sphere.
fn direction(seed: u64, draw: u64) -> Vec3<f64> {
    let (z, around) = (signed(seed, draw), PI * signed(seed, draw + 1));
    let rho = (1.0 - z * z).sqrt();
    vec3(rho * around.cos(), rho * around.sin(), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pose_is_off_by_the_stated_angle_and_distance_in_its_own_direction() {
        let target = vec3(0.0, 0.0, -0.3);
        let camera = Camera::look_at(vec3(1.0, -2.0, 0.7), target, vec3(0.0, 0.0, 1.0), 0.9, [48, 36]);
        let mut shifts = Vec::new();
        for seed in 0..20 {
            let told = estimated(&camera, target, seed).world_from_camera;
            let own = camera.world_from_camera;
            let shift = told.translation - own.translation;
            let distance = (own.translation - target).length();
            assert!((shift.length() / distance - POSITION_ERROR).abs() < 1e-12);
            // The trace of a rotation by θ is 1 + 2 cos θ.
            let trace: f64 = (0..3).map(|k| told.rotation.columns[k].dot(own.rotation.columns[k])).sum();
            let angle = (0.5 * (trace - 1.0)).acos().to_degrees();
            assert!((angle - TURN_ERROR).abs() < 1e-6, "{angle}");
            shifts.push(shift / shift.length());
        }
        let mean = shifts.iter().fold(Vec3::zero(), |sum, &s| sum + s) / 20.0;
        assert!(mean.length() < 0.5, "{mean:?}");
    }
}
