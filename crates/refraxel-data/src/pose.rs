//! Is a matrix a camera pose? Small errors of rounding are repaired, everything else is refused with its reason.

use crate::Problem;
use refraxel_core::{Mat3, Pose, Vec3};
use std::path::Path;

/// Largest |RᵀR − 1| that is repaired without a note: single precision with some digits lost in text.
const EXACT: f64 = 1e-5;
/// Largest coordinate of a camera [scene unit]: its cube is a number in single precision, too.
const FARTHEST: f64 = 1e12;
/// Largest |RᵀR − 1| that is repaired.
const REPAIRABLE: f64 = 1e-2;

/// Why a matrix is not a camera pose.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PoseFault {
    /// An entry is NaN or infinite.
    #[error("the pose has an entry that is not a finite number")]
    NotFinite,
    /// The camera is too far away.
    #[error(
        "the camera stands {0:.1e} scene units from the origin, at most {farthest:.0e} can be computed with; choose another unit of length",
        farthest = FARTHEST
    )]
    TooFar(f64),
    /// The rotation contains a reflection.
    #[error("the rotation has determinant {0:.3}: it mirrors the world (one axis has the wrong sign)")]
    Mirrored(f64),
    /// No rotation can be extracted.
    #[error("the rotation is singular (determinant {0:.1e})")]
    Singular(f64),
    /// The rotation contains scale or shear.
    #[error(
        "the rotation is {0:.2e} away from orthonormal (at most 1e-2 is repaired): it contains scale or shear"
    )]
    NotRotation(f64),
    /// A quaternion that is not of unit length.
    #[error("the quaternion has length {0:.4}; expected 1")]
    Quaternion(f64),
}

/// A pose that is a rigid motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CheckedPose {
    pub pose: Pose,
    /// Largest entry of |RᵀR − 1| before it was removed.
    pub error: f64,
    /// The same where it is worth a note, beside a scale.
    pub repaired: Option<f64>,
    /// The length of all three axes where it was not 1.
    pub scale: Option<f64>,
}

/// Checks that `pose` is finite and rigid, and removes small deviations.
///
/// A scale that all three axes share is removed as well: matrices of scaled objects and scenes have one, and neither directions nor
/// positions need it.
pub(crate) fn check(pose: &Pose) -> Result<CheckedPose, PoseFault> {
    let rotation = &pose.rotation;
    if !(rotation.columns.iter().all(|c| c.is_finite()) && pose.translation.is_finite()) {
        return Err(PoseFault::NotFinite);
    }
    let farthest = pose.translation.map(f64::abs).max_element();
    if farthest > FARTHEST {
        return Err(PoseFault::TooFar(farthest));
    }
    let (error, det) = (deviation(rotation), rotation.determinant());
    let scale = Some(det.cbrt()).filter(|_| error > REPAIRABLE && det > 0.0);
    let unscaled = scale.map_or(*rotation, |s| Mat3 { columns: rotation.columns.map(|c| c / s) });
    let left = if scale.is_some() { deviation(&unscaled) } else { error };
    if left > REPAIRABLE || det <= 0.0 {
        // A mirrored rotation is still orthonormal up to a scale.
        let scale = rotation.columns[0].length();
        return Err(match det {
            _ if det.abs() <= 1e-6 * scale.powi(3) => PoseFault::Singular(det),
            _ if det < 0.0 => PoseFault::Mirrored(det),
            _ => PoseFault::NotRotation(error),
        });
    }
    let repaired = (left > EXACT).then_some(left);
    Ok(CheckedPose { pose: Pose { rotation: orthonormal(&unscaled), ..*pose }, error, repaired, scale })
}

/// Largest entry of |RᵀR − 1|.
fn deviation(r: &Mat3<f64>) -> f64 {
    let product = (r.transpose() * *r).rows();
    let entry = |i: usize, j: usize| (product[i][j] - if i == j { 1.0 } else { 0.0 }).abs();
    (0..9).map(|k| entry(k / 3, k % 3)).fold(0.0, f64::max)
}

/// The nearest rotation, by Newton's iteration for the polar factor R ← (3R − R RᵀR) / 2 (Björck and Bowie 1971).
/// Quadratic: an error of 1e-2 is below rounding after four steps.
fn orthonormal(r: &Mat3<f64>) -> Mat3<f64> {
    (0..4).fold(*r, |r, _| {
        let cubed = r * (r.transpose() * r);
        Mat3 { columns: [0, 1, 2].map(|c| (r.columns[c] * 3.0 - cubed.columns[c]) * 0.5) }
    })
}

/// The rotation of a Hamilton quaternion (w, x, y, z), normalised; lengths off by more than 1e-3 are refused.
pub(crate) fn rotation_of_quaternion([w, x, y, z]: [f64; 4]) -> Result<Mat3<f64>, PoseFault> {
    let length = (w * w + x * x + y * y + z * z).sqrt();
    if !length.is_finite() {
        return Err(PoseFault::NotFinite);
    }
    if (length - 1.0).abs() > 1e-3 {
        return Err(PoseFault::Quaternion(length));
    }
    let [w, x, y, z] = [w, x, y, z].map(|v| v / length);
    Ok(Mat3::from_rows([
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]))
}

/// The unit quaternion (w, x, y, z) of a rotation, from its largest component for the sake of digits.
pub fn quaternion_of_rotation(rotation: &Mat3<f64>) -> [f64; 4] {
    let r = rotation.rows();
    // Four times the products of the components with each other.
    let products = [
        [1.0 + r[0][0] + r[1][1] + r[2][2], r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]],
        [r[2][1] - r[1][2], 1.0 + r[0][0] - r[1][1] - r[2][2], r[0][1] + r[1][0], r[0][2] + r[2][0]],
        [r[0][2] - r[2][0], r[0][1] + r[1][0], 1.0 - r[0][0] + r[1][1] - r[2][2], r[1][2] + r[2][1]],
        [r[1][0] - r[0][1], r[0][2] + r[2][0], r[1][2] + r[2][1], 1.0 - r[0][0] - r[1][1] + r[2][2]],
    ];
    let largest = (0..4).fold(0, |best, k| if products[k][k] > products[best][best] { k } else { best });
    let row = products[largest];
    let norm = row.iter().map(|q| q * q).sum::<f64>().sqrt();
    row.map(|q| q / norm)
}

/// The first three rows of a camera's matrix, or its first three columns and `true` where it is transposed: the position stands below the
/// rotation, and zeros beside it. Of a camera at the origin nobody can tell.
pub(crate) fn rows_or_columns(matrix: [[f64; 4]; 4]) -> ([[f64; 4]; 3], bool) {
    let [a, b, c, last] = matrix;
    let is_transposed = [a[3], b[3], c[3]] == [0.0; 3] && last[..3] != [0.0; 3];
    let column = |k: usize| matrix.map(|row| row[k]);
    (if is_transposed { [column(0), column(1), column(2)] } else { [a, b, c] }, is_transposed)
}

/// A warning about matrices of a file that were taken for transposed.
pub(crate) fn transposed(path: &Path, count: usize) -> Option<Problem> {
    let message = format!(
        "{}: {count} matrices have their position in the last row and zeros in the last column: they are read as transposed",
        path.display()
    );
    (count > 0).then(|| Problem::warning(message))
}

/// Camera-to-world rows with OpenGL camera axes (right, up, backwards) to a pose with OpenCV axes.
pub(crate) fn from_opengl(rows: [[f64; 4]; 3]) -> Pose {
    with_opengl_axes(from_opencv(rows))
}

/// A camera-to-world pose whose camera axes are those of OpenGL, with OpenCV axes.
pub(crate) fn with_opengl_axes(pose: Pose) -> Pose {
    let [right, up, back] = pose.rotation.columns;
    Pose { rotation: Mat3 { columns: [right, -up, -back] }, ..pose }
}

/// Camera-to-world rows with OpenCV camera axes.
pub(crate) fn from_opencv(rows: [[f64; 4]; 3]) -> Pose {
    let column = |c: usize| Vec3::new(rows[0][c], rows[1][c], rows[2][c]);
    Pose { rotation: Mat3 { columns: [column(0), column(1), column(2)] }, translation: column(3) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    fn posed(rotation: Mat3<f64>) -> Pose {
        Pose { rotation, translation: vec3(1.0, 2.0, 3.0) }
    }

    fn turned() -> Mat3<f64> {
        rotation_of_quaternion([0.5, 0.5, -0.5, 0.5]).unwrap()
    }

    #[test]
    fn small_errors_are_repaired_to_the_nearest_rotation_and_reported() {
        let mut rotation = turned();
        rotation.columns[0] *= 1.003;
        let checked = check(&posed(rotation)).unwrap();
        assert!(checked.repaired.is_some());
        assert!(deviation(&checked.pose.rotation) < 1e-15);
        assert!(
            (checked.pose.rotation.columns[0] - turned().columns[0]).length() < 1e-12,
            "no axis was turned"
        );
        assert_eq!(check(&posed(turned())).unwrap().repaired, None);
    }

    #[test]
    fn a_scale_that_all_axes_share_is_removed_and_reported() {
        for scale in [1e-3, 0.5, 3.0, 1e6] {
            let checked = check(&posed(Mat3 { columns: turned().columns.map(|c| c * scale) })).unwrap();
            assert!((checked.scale.unwrap() / scale - 1.0).abs() < 1e-12);
            assert!((checked.pose.rotation.columns[0] - turned().columns[0]).length() < 1e-12);
            assert_eq!((checked.pose.translation, checked.repaired), (vec3(1.0, 2.0, 3.0), None));
        }
        assert_eq!(check(&posed(turned())).unwrap().scale, None);
    }

    #[test]
    fn what_is_not_a_rotation_is_named() {
        let [a, b, c] = turned().columns;
        let fault = |columns| check(&posed(Mat3 { columns })).unwrap_err();
        assert_eq!(fault([a, b, vec3(f64::NAN, 0.0, 0.0)]), PoseFault::NotFinite);
        let away = Pose { rotation: turned(), translation: vec3(0.0, -1e300, 0.0) };
        assert_eq!(check(&away).unwrap_err(), PoseFault::TooFar(1e300));
        assert!(matches!(fault([a, b, -c]), PoseFault::Mirrored(_)));
        assert!(matches!(fault([a, b, b]), PoseFault::Singular(_)));
        assert!(matches!(fault([a, b, vec3(0.0, 0.0, 0.0)]), PoseFault::Singular(_)));
        assert!(matches!(fault([a * 2.0, b * 2.0, c * 2.2]), PoseFault::NotRotation(_)));
        assert!(matches!(fault([a * 2.0, b * 2.0, c * -2.0]), PoseFault::Mirrored(_)));
        assert!(matches!(rotation_of_quaternion([0.0; 4]), Err(PoseFault::Quaternion(_))));
        assert!(matches!(rotation_of_quaternion([f64::NAN; 4]), Err(PoseFault::NotFinite)));
    }

    #[test]
    fn a_quaternion_turns_as_hamilton_says() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let about_z = rotation_of_quaternion([half, 0.0, 0.0, half]).unwrap();
        assert!((about_z * vec3(1.0, 0.0, 0.0) - vec3(0.0, 1.0, 0.0)).length() < 1e-15);
    }
}
