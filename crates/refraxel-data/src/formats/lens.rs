//! Lenses by their coefficients, where a format does not name the simplest one.

use refraxel_core::Lens;

/// Radial k1..k4 and tangential p1, p2 as OpenCV orders them.
pub(super) fn opencv(k: [f64; 4], p: [f64; 2]) -> Lens {
    if k == [0.0; 4] && p == [0.0; 2] { Lens::Pinhole } else { Lens::OpenCv { k, p } }
}

/// The same coefficients in the plane of angles from the axis.
pub(super) fn fisheye(k: [f64; 4], p: [f64; 2]) -> Lens {
    if p == [0.0; 2] { Lens::Fisheye { k } } else { Lens::ThinPrismFisheye { k, p, s: [0.0; 2] } }
}
