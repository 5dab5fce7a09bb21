//! What a usable camera and a usable set of cameras have, wherever they come from.

use crate::Problem;
use refraxel_core::{Camera, Lens};

/// Fewest views that a scene can be reconstructed from.
pub(crate) const MIN_VIEWS: usize = 3;

/// True where both focal lengths are finite and > 0.
pub(crate) fn has_focal(camera: &Camera) -> bool {
    camera.focal.iter().all(|f| f.is_finite() && *f > 0.0)
}

/// True where the principal point is finite.
pub(crate) fn has_center(camera: &Camera) -> bool {
    camera.center.iter().all(|c| c.is_finite())
}

/// True where all coefficients of the lens are finite.
pub(crate) fn has_lens(camera: &Camera) -> bool {
    let are_finite = |list: &[f64]| list.iter().all(|v| v.is_finite());
    match &camera.lens {
        Lens::Pinhole | Lens::Equirectangular => true,
        Lens::OpenCv { k, p } => are_finite(k) && are_finite(p),
        Lens::FullOpenCv { k, p } => are_finite(k) && are_finite(p),
        Lens::Fisheye { k } => are_finite(k),
        Lens::Fov { omega } => omega.is_finite(),
        Lens::ThinPrismFisheye { k, p, s } => are_finite(k) && are_finite(p) && are_finite(s),
    }
}

/// What all cameras have in common so that depth cannot be reconstructed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Coincidence {
    /// Place and direction.
    Pose,
    /// The place alone.
    Place,
}

/// What all cameras have in common, if it is anything.
pub(crate) fn coincidence<'a>(cameras: impl Iterator<Item = &'a Camera> + Clone) -> Option<Coincidence> {
    let first = cameras.clone().next()?.world_from_camera;
    let is_there = |c: &Camera| (c.world_from_camera.translation - first.translation).length() == 0.0;
    if !cameras.clone().all(is_there) {
        return None;
    }
    let is_same = cameras.clone().all(|c| c.world_from_camera == first);
    Some(if is_same { Coincidence::Pose } else { Coincidence::Place })
}

/// The warning about cameras that all stand in one place.
pub(crate) fn one_place() -> Problem {
    Problem::warning("all views are taken from one point: depth cannot be reconstructed")
}

/// A note about rotations that were repaired, by their errors.
pub(crate) fn repairs(errors: &[f64]) -> Option<Problem> {
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let count = errors.len();
    (count > 0).then(|| {
        Problem::note(format!(
            "{count} rotations were up to {worst:.1e} away from orthonormal and were repaired"
        ))
    })
}
