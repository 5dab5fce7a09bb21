//! What all cameras do together: photographs cannot tell it from the scene doing the opposite.

use super::correction::Correction;
use crate::least_squares::solved;
use refraxel_core::{Pose, Vec3};

/// Leaves out of corrections the similarity that is nearest to them, theory (8.5): a turn, a way and a growth of all cameras about
/// their middle. A turn of 1 rad counts like `unit`. Without `growth`, that stays.
pub(super) fn without_gauge(given: &[Pose], unit: f64, growth: bool, corrections: &mut [Correction]) {
    let count = given.len().max(1) as f64;
    let middle = given.iter().fold(Vec3::zero(), |sum, p| sum + p.translation) * (1.0 / count);
    let (mut matrix, mut right) = ([0.0; 49], [0.0; 7]);
    for (pose, c) in given.iter().zip(&*corrections) {
        for (row, value) in rows(pose.translation - middle, unit).into_iter().zip(c.numbers(unit)) {
            for i in 0..7 {
                (0..7).for_each(|j| matrix[7 * i + j] += row[i] * row[j]);
                right[i] += row[i] * value * unit;
            }
        }
    }
    let Some(s) = solved(&matrix, &right, 1e-9) else { return };
    let (turn, way) = (Vec3 { x: s[0], y: s[1], z: s[2] }, Vec3 { x: s[3], y: s[4], z: s[5] });
    for (pose, c) in given.iter().zip(corrections) {
        let from_middle = pose.translation - middle;
        c.rotation -= turn;
        c.translation -= turn.cross(from_middle) + way + from_middle * if growth { s[6] } else { 0.0 };
    }
}

/// How the six values of a camera depend on the similarity.
fn rows(c: Vec3<f64>, unit: f64) -> [[f64; 7]; 6] {
    [
        [unit, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, unit, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, unit, 0.0, 0.0, 0.0, 0.0],
        [0.0, c.z, -c.y, 1.0, 0.0, 0.0, c.x],
        [-c.z, 0.0, c.x, 0.0, 1.0, 0.0, c.y],
        [c.y, -c.x, 0.0, 0.0, 0.0, 1.0, c.z],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Mat3, vec3};

    fn given() -> Vec<Pose> {
        let at = |k: u32| {
            let a = 1.7 * f64::from(k);
            Pose {
                rotation: Mat3::identity(),
                translation: vec3(4.0 * a.cos(), 3.0 * a.sin(), 1.0 + 0.3 * a),
            }
        };
        (0..9).map(at).collect()
    }

    #[test]
    fn a_similarity_of_all_cameras_is_left_out() {
        let given = given();
        let (turn, way, growth) = (vec3(0.01, -0.02, 0.005), vec3(0.1, 0.0, -0.2), 0.03);
        let of = |p: &Pose| {
            let translation = turn.cross(p.translation) + way + p.translation * growth;
            Correction { rotation: turn, translation }
        };
        let mut all: Vec<Correction> = given.iter().map(of).collect();
        without_gauge(&given, 4.0, true, &mut all);
        assert!(all.iter().all(|c| c.rotation.length() < 1e-8 && c.translation.length() < 1e-7), "{all:?}");
    }

    #[test]
    fn growth_stays_where_lenses_learn() {
        let given = given();
        let middle =
            given.iter().fold(Vec3::zero(), |sum, p| sum + p.translation) * (1.0 / given.len() as f64);
        let grown =
            |p: &Pose| Correction { translation: (p.translation - middle) * 0.03, ..Correction::default() };
        let before: Vec<Correction> = given.iter().map(grown).collect();
        let mut all = before.clone();
        without_gauge(&given, 4.0, false, &mut all);
        assert!(all.iter().zip(&before).all(|(a, b)| (a.translation - b.translation).length() < 1e-7));
    }

    #[test]
    fn what_one_camera_does_alone_stays_for_the_most_part() {
        let (given, own) = (given(), vec3(0.0, 0.02, 0.0));
        let mut all = vec![Correction::default(); given.len()];
        all[3].rotation = own;
        without_gauge(&given, 4.0, true, &mut all);
        assert!((all[3].rotation - own).length() < 0.3 * own.length());
    }
}
