//! COLMAP's camera models and how they map to lenses.

use crate::DataError;
use crate::parsed::{Focal, Intrinsics};
use refraxel_core::Lens;
use std::path::PathBuf;

/// Name and number of parameters by COLMAP's model id.
const MODELS: [(&str, usize); 18] = [
    ("SIMPLE_PINHOLE", 3),
    ("PINHOLE", 4),
    ("SIMPLE_RADIAL", 4),
    ("RADIAL", 5),
    ("OPENCV", 8),
    ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12),
    ("FOV", 5),
    ("SIMPLE_RADIAL_FISHEYE", 4),
    ("RADIAL_FISHEYE", 5),
    ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    ("SIMPLE_DIVISION", 4),
    ("DIVISION", 5),
    ("SIMPLE_FISHEYE", 3),
    ("FISHEYE", 4),
    ("EUCM", 6),
    ("EQUIRECTANGULAR", 2),
];

/// One camera of the cameras file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Calibration {
    /// The cameras file.
    pub path: PathBuf,
    /// Line or camera id, for messages.
    pub key: String,
    /// Model name.
    pub model: String,
    /// Width and height [pixel].
    pub size: [u64; 2],
    /// In COLMAP's order.
    pub parameters: Vec<f64>,
}

/// Name and number of parameters of a model id.
pub(super) fn by_id(id: i32) -> Option<(&'static str, usize)> {
    MODELS.get(usize::try_from(id).ok()?).copied()
}

impl Calibration {
    /// The intrinsics of this camera.
    pub fn intrinsics(&self) -> Result<Intrinsics, DataError> {
        let size = self.size.map(|s| s as f64);
        if !size.iter().all(|s| (1.0..=1e6).contains(s)) {
            return Err(self.fault(
                "size",
                format!("{}x{}", self.size[0], self.size[1]),
                "1 to 1000000 pixels",
            ));
        }
        let known = MODELS.iter().find(|(name, _)| *name == self.model);
        let &(_, expected) = known.ok_or_else(|| self.unsupported())?;
        if self.parameters.len() != expected || !self.parameters.iter().all(|v| v.is_finite()) {
            let found = format!("{:?}", self.parameters);
            return Err(self.fault("PARAMS", found, "as many finite numbers as the camera model has"));
        }
        let (focal, center, lens) = self.project()?;
        Ok(Intrinsics { size: Some(size), focal, center, lens })
    }

    fn project(&self) -> Result<(Focal, Option<[f64; 2]>, Lens), DataError> {
        let one = |f: f64, cx, cy, lens| Ok((Focal::Pixels([f, f]), Some([cx, cy]), lens));
        let two = |fx, fy, cx, cy, lens| Ok((Focal::Pixels([fx, fy]), Some([cx, cy]), lens));
        let radial = |k1, k2| Lens::OpenCv { k: [k1, k2, 0.0, 0.0], p: [0.0; 2] };
        let fisheye = |k1, k2| Lens::Fisheye { k: [k1, k2, 0.0, 0.0] };
        match (self.model.as_str(), self.parameters.as_slice()) {
            ("SIMPLE_PINHOLE", &[f, cx, cy]) => one(f, cx, cy, Lens::Pinhole),
            ("PINHOLE", &[fx, fy, cx, cy]) => two(fx, fy, cx, cy, Lens::Pinhole),
            ("SIMPLE_RADIAL", &[f, cx, cy, k]) => one(f, cx, cy, radial(k, 0.0)),
            ("RADIAL", &[f, cx, cy, k1, k2]) => one(f, cx, cy, radial(k1, k2)),
            ("OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2]) => {
                two(fx, fy, cx, cy, Lens::OpenCv { k: [k1, k2, 0.0, 0.0], p: [p1, p2] })
            }
            ("FULL_OPENCV", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
                two(fx, fy, cx, cy, Lens::FullOpenCv { k: [k1, k2, k3, k4, k5, k6], p: [p1, p2] })
            }
            ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => {
                two(fx, fy, cx, cy, Lens::Fisheye { k: [k1, k2, k3, k4] })
            }
            ("SIMPLE_FISHEYE", &[f, cx, cy]) => one(f, cx, cy, fisheye(0.0, 0.0)),
            ("FISHEYE", &[fx, fy, cx, cy]) => two(fx, fy, cx, cy, fisheye(0.0, 0.0)),
            ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => one(f, cx, cy, fisheye(k, 0.0)),
            ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => one(f, cx, cy, fisheye(k1, k2)),
            ("FOV", &[fx, fy, cx, cy, omega]) if omega.abs() < 1e-6 => two(fx, fy, cx, cy, Lens::Pinhole),
            ("FOV", &[fx, fy, cx, cy, omega]) => two(fx, fy, cx, cy, Lens::Fov { omega: omega.abs() }),
            ("THIN_PRISM_FISHEYE", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, sx, sy]) => {
                let lens = Lens::ThinPrismFisheye { k: [k1, k2, k3, k4], p: [p1, p2], s: [sx, sy] };
                two(fx, fy, cx, cy, lens)
            }
            ("EQUIRECTANGULAR", _) => Ok((Focal::Panorama, None, Lens::Equirectangular)),
            _ => Err(self.unsupported()),
        }
    }

    fn unsupported(&self) -> DataError {
        let (path, key, model) = (self.path.clone(), self.key.clone(), self.model.clone());
        DataError::UnsupportedCamera { path, key, model }
    }

    fn fault(&self, field: &str, found: String, expected: &'static str) -> DataError {
        let key = format!("{} ({field} of {})", self.key, self.model);
        DataError::Value { path: self.path.clone(), key, found, expected }
    }
}
