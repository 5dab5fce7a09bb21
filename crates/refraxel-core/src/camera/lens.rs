//! Lens models: from normalised distorted image coordinates to a direction and back, theory (1.3).
//!
//! Every model but the panorama is a *projection* (perspective: x/z, or equidistant: the angle θ from the axis) followed
//! by one smooth map of the plane, [`Distortion`]. Distorted pixels are traced as they are; images are never resampled.

use super::distortion::Distortion;
use crate::{Vec3, vec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// How directions map to normalised image coordinates (pixel − centre) / focal, theory (1.2) and (1.3).
///
/// Coefficients follow COLMAP and OpenCV; models with fewer coefficients are the same model with zeros
/// (`SIMPLE_RADIAL` is [`Lens::OpenCv`] with one k, `RADIAL_FISHEYE` is [`Lens::Fisheye`] with two).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// (x/z, y/z), no distortion.
    Pinhole,
    /// Brown–Conrady: radial factor 1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸, tangential p1, p2.
    OpenCv {
        /// k1..k4.
        k: [f64; 4],
        /// p1, p2.
        p: [f64; 2],
    },
    /// OpenCV's rational model: radial factor (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶), tangential p.
    FullOpenCv {
        /// k1..k6; the last three are the denominator.
        k: [f64; 6],
        /// p1, p2.
        p: [f64; 2],
    },
    /// Kannala–Brandt: image radius θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸) at the angle θ from the axis.
    Fisheye {
        /// k1..k4.
        k: [f64; 4],
    },
    /// Devernay–Faugeras field of view: image radius atan(2 r tan(ω/2)) / ω.
    Fov {
        /// ω [rad], > 0.
        omega: f64,
    },
    /// [`Lens::Fisheye`] plus tangential and thin-prism terms, all in the equidistant plane.
    ThinPrismFisheye {
        /// k1..k4.
        k: [f64; 4],
        /// p1, p2.
        p: [f64; 2],
        /// sx1, sy1.
        s: [f64; 2],
    },
    /// The whole sphere: coordinates are (azimuth, elevation below the horizon) [rad], so focal = (W / 2π, H / π).
    Equirectangular,
}

/// The projection of a lens: the meaning of its plane coordinates before distortion.
enum Projection {
    /// (x, y) / z.
    Perspective,
    /// θ (x, y) / √(x² + y²).
    Equidistant,
}

impl Lens {
    /// The (unnormalised) direction in the camera frame that the lens images at `distorted`.
    ///
    /// Newton's method to a residual below 1e-9 of the focal length. `None` outside the image of the lens: beyond the
    /// fold, where the distortion stops being one-to-one, or beyond the sphere of a panorama.
    pub fn direction(&self, distorted: [f64; 2]) -> Option<Vec3<f64>> {
        let (projection, distortion) = match self {
            Lens::Pinhole => return Some(vec3(distorted[0], distorted[1], 1.0)),
            Lens::Equirectangular => return panorama_direction(distorted),
            Lens::Fov { omega } => return fov_direction(*omega, distorted),
            _ => self.plane()?,
        };
        let [u, v] = distortion.invert(distorted)?;
        match projection {
            Projection::Perspective => Some(vec3(u, v, 1.0)),
            Projection::Equidistant => {
                let theta = u.hypot(v);
                let sinc = if theta > 0.0 { theta.sin() / theta } else { 1.0 };
                (theta <= PI).then(|| vec3(u * sinc, v * sinc, theta.cos()))
            }
        }
    }

    /// Normalised distorted image coordinates of a point in the camera frame; `None` where [`Lens::direction`] has no
    /// pixel for it (behind a perspective lens, beyond the fold).
    pub fn project(&self, x: Vec3<f64>) -> Option<[f64; 2]> {
        self.project_where(x, |_| true)
    }

    /// [`Self::project`], `None` also where the coordinates are not wanted: whether they lie beyond the fold takes several times as long
    /// as they do, and is not asked then.
    pub(super) fn project_where(&self, x: Vec3<f64>, wanted: impl Fn([f64; 2]) -> bool) -> Option<[f64; 2]> {
        let projected = match self {
            Lens::Pinhole => (x.z > 0.0).then(|| [x.x / x.z, x.y / x.z]),
            Lens::Equirectangular => {
                let horizontal = x.x.hypot(x.z);
                (horizontal + x.y.abs() > 0.0).then(|| [x.x.atan2(x.z), x.y.atan2(horizontal)])
            }
            Lens::Fov { omega } => fov_project(*omega, x),
            _ => {
                let (projection, distortion) = self.plane()?;
                let undistorted = match projection {
                    Projection::Perspective => (x.z > 0.0).then(|| [x.x / x.z, x.y / x.z])?,
                    Projection::Equidistant => equidistant(x)?,
                };
                let (distorted, _) = distortion.apply(undistorted);
                let is_shown = wanted(distorted) && distortion.one_to_one_up_to(undistorted);
                return is_shown.then_some(distorted);
            }
        };
        projected.filter(|at| wanted(*at))
    }

    /// Projection and plane distortion of the models that are made of these two.
    fn plane(&self) -> Option<(Projection, Distortion)> {
        let zero = Distortion::default();
        match *self {
            Lens::OpenCv { k, p } => Some((Projection::Perspective, Distortion { radial: k, p, ..zero })),
            Lens::FullOpenCv { k: [k1, k2, k3, k4, k5, k6], p } => {
                let distortion =
                    Distortion { radial: [k1, k2, k3, 0.0], denominator: [k4, k5, k6], p, ..zero };
                Some((Projection::Perspective, distortion))
            }
            Lens::Fisheye { k } => Some((Projection::Equidistant, Distortion { radial: k, ..zero })),
            Lens::ThinPrismFisheye { k, p, s } => {
                Some((Projection::Equidistant, Distortion { radial: k, p, s, ..zero }))
            }
            Lens::Pinhole | Lens::Fov { .. } | Lens::Equirectangular => None,
        }
    }
}

/// θ (x, y) / √(x² + y²): the equidistant plane of the fisheye models. `None` straight behind the camera.
fn equidistant(x: Vec3<f64>) -> Option<[f64; 2]> {
    let r = x.x.hypot(x.y);
    if r == 0.0 {
        return (x.z > 0.0).then_some([0.0, 0.0]);
    }
    let scale = r.atan2(x.z) / r;
    Some([x.x * scale, x.y * scale])
}

/// Direction of a panorama's coordinates [rad]; `None` beyond the sphere.
fn panorama_direction([azimuth, below]: [f64; 2]) -> Option<Vec3<f64>> {
    const ROUNDING: f64 = 1e-9; // rad: the image border is the seam of the sphere
    let inside = azimuth.abs() <= PI + ROUNDING && below.abs() <= FRAC_PI_2 + ROUNDING;
    inside.then(|| vec3(azimuth.sin() * below.cos(), below.sin(), azimuth.cos() * below.cos()))
}

/// Inverse of [`fov_project`]: r = tan(r_d ω) / (2 tan(ω/2)) for a distorted radius r_d; `None` from a radius of π/2ω on.
fn fov_direction(omega: f64, [u, v]: [f64; 2]) -> Option<Vec3<f64>> {
    let r_d = u.hypot(v);
    if r_d == 0.0 {
        return Some(vec3(0.0, 0.0, 1.0));
    }
    // atan reaches π/2 only at infinite radius.
    let scale = (r_d * omega).tan() / (2.0 * (0.5 * omega).tan() * r_d);
    (r_d * omega < FRAC_PI_2).then(|| vec3(u * scale, v * scale, 1.0))
}

/// The field-of-view model of Devernay & Faugeras 2001: r_d = atan(2 r tan(ω/2)) / ω; `None` behind the camera.
fn fov_project(omega: f64, x: Vec3<f64>) -> Option<[f64; 2]> {
    let [u, v] = (x.z > 0.0).then(|| [x.x / x.z, x.y / x.z])?;
    let r = u.hypot(v);
    let scale = if r > 0.0 { (2.0 * r * (0.5 * omega).tan()).atan() / (omega * r) } else { 1.0 };
    Some([u * scale, v * scale])
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODELS: [Lens; 7] = [
        Lens::Pinhole,
        Lens::OpenCv { k: [0.0578421, -0.0805099, 0.01, -0.002], p: [-0.00098, 0.00016] },
        Lens::FullOpenCv { k: [0.3, -0.05, 0.02, 0.25, -0.03, 0.01], p: [0.001, -0.002] },
        Lens::Fisheye { k: [-0.02, 0.004, -0.002, 0.0003] },
        Lens::Fov { omega: 0.9 },
        Lens::ThinPrismFisheye { k: [-0.02, 0.004, -0.001, 0.0], p: [0.001, 0.0005], s: [0.002, -0.001] },
        Lens::Equirectangular,
    ];

    #[test]
    fn projecting_the_direction_of_a_pixel_gives_back_the_pixel_over_the_whole_image() {
        const TOL: f64 = 2e-9; // twice the accepted Newton residual
        for lens in MODELS {
            for i in -10..=10 {
                for j in -10..=10 {
                    let pixel = [0.083 * f64::from(i), 0.079 * f64::from(j)];
                    let direction = lens.direction(pixel).unwrap_or_else(|| panic!("{lens:?} at {pixel:?}"));
                    let back = lens.project(direction * 3.0).unwrap();
                    assert!((back[0] - pixel[0]).abs() < TOL && (back[1] - pixel[1]).abs() < TOL, "{lens:?}");
                }
            }
        }
    }

    #[test]
    fn distortion_formulas_reproduce_values_worked_by_hand() {
        // r² = 0.25: factor 1 + 0.1/4 − 0.2/16 = 1.0125; tangential u: 2 p1 u v + p2 (r² + 2u²) = 0.00192 + 0.02·0.43.
        let lens = Lens::OpenCv { k: [0.1, -0.2, 0.0, 0.0], p: [0.008, 0.02] };
        let [u, v] = lens.project(vec3(0.3, 0.4, 1.0)).unwrap();
        assert!((u - (0.3 * 1.0125 + 2.0 * 0.008 * 0.12 + 0.02 * 0.43)).abs() < 1e-15);
        assert!((v - (0.4 * 1.0125 + 2.0 * 0.02 * 0.12 + 0.008 * 0.57)).abs() < 1e-15);
        // 90° off the axis of an ideal fisheye is π/2 focal lengths from the centre, and 135° is 3π/4.
        let fisheye = Lens::Fisheye { k: [0.0; 4] };
        assert!((fisheye.project(vec3(1.0, 0.0, 0.0)).unwrap()[0] - FRAC_PI_2).abs() < 1e-15);
        assert!((fisheye.project(vec3(0.0, 1.0, -1.0)).unwrap()[1] - 0.75 * PI).abs() < 1e-15);
        assert!(fisheye.direction([0.0, 0.75 * PI]).unwrap().z < 0.0);
        // A quarter turn to the right of a panorama, and straight down.
        let [azimuth, below] = Lens::Equirectangular.project(vec3(1.0, 0.0, 0.0)).unwrap();
        assert!((azimuth - FRAC_PI_2).abs() < 1e-15 && below == 0.0);
        assert!((Lens::Equirectangular.project(vec3(0.0, 2.0, 0.0)).unwrap()[1] - FRAC_PI_2).abs() < 1e-15);
        // The field-of-view model maps tan(ω/2) off the axis to half a unit.
        let fov = Lens::Fov { omega: 1.2 };
        let expected = (2.0 * 0.6_f64.tan() * 0.6_f64.tan()).atan() / 1.2;
        assert!((fov.project(vec3(0.6_f64.tan(), 0.0, 1.0)).unwrap()[0] - expected).abs() < 1e-15);
    }

    #[test]
    fn beyond_the_fold_there_is_no_direction_and_no_pixel() {
        // r (1 − r²/3) rises until r = 1, where it is 2/3, and falls behind.
        let barrel = Lens::OpenCv { k: [-1.0 / 3.0, 0.0, 0.0, 0.0], p: [0.0; 2] };
        assert!(barrel.direction([0.66, 0.0]).is_some());
        assert!(barrel.direction([0.67, 0.0]).is_none());
        assert!(barrel.project(vec3(0.99, 0.0, 1.0)).is_some());
        assert!(barrel.project(vec3(1.01, 0.0, 1.0)).is_none(), "this point would land inside the image");
        assert!(barrel.project(vec3(5.0, 0.0, 1.0)).is_none(), "far behind the fold");
        let fisheye = Lens::Fisheye { k: [-1.0 / 3.0, 0.0, 0.0, 0.0] };
        assert!(fisheye.direction([0.0, 0.67]).is_none());
        assert!(fisheye.project(vec3(0.0, 1.1_f64.tan(), 1.0)).is_none());
        // A second rising branch behind the fold is not the lens either: r (1 − 0.6 r² + 0.12 r⁴) with a dip.
        let dip = Lens::OpenCv { k: [-0.75, 0.16, 0.0, 0.0], p: [0.0; 2] };
        assert!(dip.project(vec3(2.5, 0.0, 1.0)).is_none());
        assert!(Lens::Fov { omega: 1.0 }.direction([1.6, 0.0]).is_none());
        assert!(Lens::Equirectangular.direction([3.2, 0.0]).is_none());
    }

    #[test]
    fn hopeless_input_has_no_direction_instead_of_a_nan() {
        for lens in MODELS.into_iter().filter(|lens| *lens != Lens::Pinhole) {
            assert!(lens.direction([f64::NAN, 0.1]).is_none(), "{lens:?}");
            assert!(lens.direction([1e30, -1e30]).is_none(), "{lens:?}");
        }
        let broken = Lens::OpenCv { k: [f64::NAN; 4], p: [0.0; 2] };
        assert!(broken.direction([0.1, 0.1]).is_none());
        assert!(broken.project(vec3(0.1, 0.1, 1.0)).is_none());
    }
}
