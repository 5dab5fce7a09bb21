//! The ellipsoid of all points that a linear map takes into the unit ball, as radii and a rotation.

use refraxel_core::{Mat3, Vec3};
use refraxel_data::quaternion_of_rotation;

/// Sweeps of the Jacobi method; it has converged to f64 after six.
const SWEEPS: usize = 8;

/// An ellipsoid about the origin.
pub(super) struct Ellipsoid {
    /// Half lengths along its axes [scene unit].
    pub(super) radii: [f64; 3],
    /// The rotation of its axes out of x, y and z, as a unit quaternion (w, x, y, z).
    pub(super) rotation: [f64; 4],
}

impl Ellipsoid {
    /// {x : |A x| ≤ 1}, `rows` being those of A: AᵀA has its axes as eigenvectors, and radius⁻² as eigenvalues.
    pub(super) fn of(rows: [Vec3<f64>; 3]) -> Self {
        let a = Mat3::from_rows(rows.map(Vec3::to_array));
        let (mut product, mut axes) = (a.transpose() * a, Mat3::identity());
        for _ in 0..SWEEPS {
            for (p, q) in [(0, 1), (0, 2), (1, 2)] {
                let turn = annihilating(&product, p, q);
                product = turn.transpose() * product * turn;
                axes = axes * turn;
            }
        }
        let radii = [0, 1, 2].map(|k| product.columns[k][k].sqrt().recip());
        Self { radii, rotation: quaternion_of_rotation(&axes) }
    }
}

/// The rotation about the third axis after which the entry (p, q) of a symmetric matrix is 0. Source: Golub & Van Loan, 8.5.
fn annihilating(m: &Mat3<f64>, p: usize, q: usize) -> Mat3<f64> {
    let mut turn = Mat3::identity();
    let off = m.columns[q][p];
    if off == 0.0 {
        return turn;
    }
    let tau = (m.columns[q][q] - m.columns[p][p]) / (2.0 * off);
    let tangent = tau.signum() / (tau.abs() + tau.hypot(1.0));
    let cosine = tangent.hypot(1.0).recip();
    let sine = tangent * cosine;
    (turn.columns[p][p], turn.columns[q][q]) = (cosine, cosine);
    (turn.columns[q][p], turn.columns[p][q]) = (sine, -sine);
    turn
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    /// q v q*, by Rodrigues' formula for unit quaternions.
    fn rotated([w, x, y, z]: [f64; 4], v: Vec3<f64>) -> Vec3<f64> {
        let q = vec3(x, y, z);
        let t = q.cross(v) * 2.0;
        v + t * w + q.cross(t)
    }

    #[test]
    fn the_ends_of_the_axes_are_taken_to_the_unit_sphere() {
        let general = [vec3(2.0, 0.3, -0.4), vec3(0.1, 0.7, 0.9), vec3(-0.5, 0.2, 4.0)];
        let half_turn = [vec3(-2.0, 0.0, 0.0), vec3(0.0, -3.0, 0.0), vec3(0.0, 0.0, 0.5)];
        for rows in [general, half_turn] {
            let Ellipsoid { radii, rotation } = Ellipsoid::of(rows);
            let a = Mat3::from_rows(rows.map(Vec3::to_array));
            let ends = [0, 1, 2].map(|k| {
                let unit = Vec3::from([0, 1, 2].map(|i| f64::from(i == k)));
                a * (rotated(rotation, unit) * radii[k])
            });
            for k in 0..3 {
                assert!((ends[k].length() - 1.0).abs() < 1e-12, "{ends:?}");
                assert!(ends[k].dot(ends[(k + 1) % 3]).abs() < 1e-12, "{ends:?}");
            }
        }
    }

    #[test]
    fn along_the_axes_nothing_turns() {
        let Ellipsoid { radii, rotation } =
            Ellipsoid::of([vec3(2.0, 0.0, 0.0), vec3(0.0, 4.0, 0.0), vec3(0.0, 0.0, 0.5)]);
        assert_eq!((radii, rotation), ([0.5, 0.25, 2.0], [1.0, 0.0, 0.0, 0.0]));
    }
}
