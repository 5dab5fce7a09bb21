//! What a usable camera and a usable set of cameras have, wherever they come from.

use crate::Problem;
use crate::pose::CheckedPose;
use crate::size::Size;
use refraxel_core::{Aabb, Camera, Lens, Vec3};
use std::path::Path;

/// Fewest views that a scene can be reconstructed from.
pub(crate) const MIN_VIEWS: usize = 3;

/// A focal length is from `FOCAL[0]` to `FOCAL[1]` times the longer edge of the picture: fields of view from 0.06 to 179
/// degrees.
const FOCAL: [f64; 2] = [0.01, 1000.0];
/// The principal point is at most so many times the longer edge away: crops of large pictures have it outside.
const CENTER: f64 = 100.0;
/// At least this share of the picture shows something; a circular fisheye fills half of it and more.
const LEAST_SHOWN: f64 = 0.1;
/// Places along each edge at which a lens is tried.
const PLACES: u32 = 9;

/// Why a camera can take no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraFault {
    /// A focal length is not finite, not positive, or belongs to another picture.
    #[error(
        "the focal lengths are {found:?} [pixel] in a picture of {size}; expected two numbers from {low} to {high} times its longer \
         edge",
        low = FOCAL[0],
        high = FOCAL[1]
    )]
    Focal {
        /// Both focal lengths [pixel].
        found: [f64; 2],
        /// The picture.
        size: Size,
    },
    /// The principal point is not finite, or far away.
    #[error(
        "the principal point is {found:?} [pixel] in a picture of {size}; expected two numbers up to {most} times its longer \
         edge",
        most = CENTER
    )]
    Center {
        /// The principal point [pixel].
        found: [f64; 2],
        /// The picture.
        size: Size,
    },
    /// A coefficient of the lens is not finite.
    #[error("the lens has a coefficient that is not a finite number")]
    Lens,
    /// Nearly no pixel has a ray.
    #[error(
        "the lens shows something on {:.0} % of the picture only; expected coefficients of distortion that belong to this lens \
         model",
        100.0 * shown
    )]
    Blind {
        /// Share of the picture that has rays.
        shown: f64,
    },
}

/// Refuses a camera that can take no picture.
pub(crate) fn check(camera: &Camera) -> Result<(), CameraFault> {
    let size = Size { width: camera.width, height: camera.height };
    let longest = f64::from(size.width.max(size.height));
    let is_focal = |f: &f64| (FOCAL[0] * longest..=FOCAL[1] * longest).contains(f) && *f > 0.0;
    if !camera.focal.iter().all(is_focal) {
        return Err(CameraFault::Focal { found: camera.focal, size });
    }
    if !camera.center.iter().all(|c| c.abs() <= CENTER * longest) {
        return Err(CameraFault::Center { found: camera.center, size });
    }
    if !has_lens(camera) {
        return Err(CameraFault::Lens);
    }
    let shown = shown(camera);
    if shown < LEAST_SHOWN { Err(CameraFault::Blind { shown }) } else { Ok(()) }
}

/// Share of the picture that has rays.
fn shown(camera: &Camera) -> f64 {
    let place = |k: u32, edge: u32| (f64::from(k) + 0.5) / f64::from(PLACES) * f64::from(edge);
    let all =
        (0..PLACES * PLACES).map(|k| [place(k % PLACES, camera.width), place(k / PLACES, camera.height)]);
    all.filter(|&[u, v]| camera.ray(u, v).is_some()).count() as f64 / f64::from(PLACES * PLACES)
}

/// True where all coefficients of the lens are finite.
fn has_lens(camera: &Camera) -> bool {
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

/// Full field of view of a lens without a fisheye model beyond which its focal length is doubted [rad].
const WIDEST: f64 = 2.6;
/// A principal point farther from the middle than this part of an edge is doubted.
const OFF_MIDDLE: f64 = 0.25;
/// Share of the picture that a circular fisheye fills.
const CIRCLE: f64 = 0.5;

/// Warnings about cameras that can take pictures and are probably not those that did.
pub(crate) fn doubts(cameras: &[Camera]) -> Vec<Problem> {
    let count = |is_odd: &dyn Fn(&Camera) -> bool| cameras.iter().filter(|c| is_odd(c)).count();
    let flat = |c: &Camera| {
        !matches!(
            c.lens,
            Lens::Equirectangular | Lens::Fisheye { .. } | Lens::ThinPrismFisheye { .. } | Lens::Fov { .. }
        )
    };
    let field = |c: &Camera| {
        (c.center[0] / c.focal[0]).atan() + ((f64::from(c.width) - c.center[0]) / c.focal[0]).atan()
    };
    let is_wide = |c: &Camera| flat(c) && field(c) > WIDEST;
    let size = |c: &Camera| [f64::from(c.width), f64::from(c.height)];
    let is_off = |c: &Camera| {
        c.lens != Lens::Equirectangular && (0..2).any(|a| (c.center[a] / size(c)[a] - 0.5).abs() > OFF_MIDDLE)
    };
    let is_blind = |c: &Camera| shown(c) < CIRCLE;
    let found: [(usize, &str); 3] = [
        (
            count(&is_wide),
            "see more than 150 degrees although their lens is no fisheye: focal lengths may be those of smaller pictures, or parts of a \
                           width",
        ),
        (
            count(&is_off),
            "have their principal point outside of their picture or far from its middle; unless the pictures are crops, cx and cy [pixel] \
             may be those of another picture, swapped, or in another unit",
        ),
        (
            count(&is_blind),
            "have no ray on more than half of their picture: coefficients of distortion may be those of another lens model",
        ),
    ];
    let of = cameras.len();
    let problem = |(count, what): (usize, &str)| {
        (count > 0).then(|| Problem::warning(format!("{count} of {of} cameras {what}")))
    };
    found.into_iter().filter_map(problem).collect()
}

/// A warning where positions look like longitude and latitude beside a height: what is far apart lies within a hair's breadth of one
/// vertical line, far away from the origin.
pub(crate) fn in_degrees(cameras: &[Camera]) -> Option<Problem> {
    /// A metre is a hundred thousandth of a degree, so heights differ by so many times more than the others do, and those are so many
    /// times their differences away from the origin.
    const TIMES: f64 = 100.0;
    let Aabb { min: low, max: high } = Aabb::around(cameras.iter().map(|c| c.world_from_camera.translation))?;
    let across = (high.x - low.x).max(high.y - low.y);
    let is_angle = |of: fn(Vec3<f64>) -> f64, most: f64| -most <= of(low) && of(high) <= most;
    let is_on_earth = is_angle(|p| p.x, 180.0) && is_angle(|p| p.y, 90.0);
    let is_far = low.x.abs().max(low.y.abs()) > TIMES * across;
    (across > 0.0 && is_on_earth && is_far && high.z - low.z > TIMES * across).then(|| {
        Problem::warning(format!(
            "the cameras stand within {across:.2e} of ({:.4}, {:.4}) in x and y, and {:.4} apart in height: x and y may be longitude and \
             latitude in degrees; export the cameras again in local or projected coordinates (UTM)",
            low.x,
            low.y,
            high.z - low.z
        ))
    })
}

/// A warning about the only camera that stands in the origin and looks along an axis, far away from all others, as programs write the
/// pose of a photograph that they could not pose.
pub(crate) fn placeholder(cameras: &[Camera], files: &[&str]) -> Option<Problem> {
    /// A first camera that all others are relative to stands as near to the second as these do to each other, or nearly.
    const FAR: f64 = 2.0;
    /// A few others show how near neighbours stand.
    const FEWEST: usize = 4;
    let is_axis = |c: Vec3<f64>| [c.x, c.y, c.z].iter().all(|v| *v == 0.0 || v.abs() == 1.0);
    let place = |c: &Camera| c.world_from_camera.translation;
    let is_one = |c: &Camera| {
        place(c) == Vec3::zero() && c.world_from_camera.rotation.columns.into_iter().all(is_axis)
    };
    let found: Vec<usize> = (0..cameras.len()).filter(|&k| is_one(&cameras[k])).collect();
    let &[alone] = found.as_slice() else { return None };
    let others: Vec<&Camera> = cameras.iter().filter(|c| !is_one(c)).collect();
    let away = |from: &Camera| {
        let away =
            others.iter().filter(|c| !std::ptr::eq(**c, from)).map(|c| (place(c) - place(from)).length());
        away.fold(f64::INFINITY, f64::min)
    };
    let widest = others.iter().map(|c| away(c)).fold(0.0, f64::max);
    (others.len() >= FEWEST && away(&cameras[alone]) > FAR * widest).then(|| {
        Problem::warning(format!(
            "the pose of {} is the identity, far away from all other cameras, as where a program could not pose a photograph: take it out of \
             the files, or pose it again",
            files[alone]
        ))
    })
}

/// A note about files, such as those of a split, whose cameras have one focal length each, and not the same one.
pub(crate) fn other_focal(cameras: &[Camera], files: &[&Path]) -> Option<Problem> {
    /// Focal lengths within this factor are one, which was rounded.
    const EQUAL: f64 = 1.005;
    let relative = |c: &Camera| c.focal[0] / f64::from(c.width);
    let is_other = |a: f64, b: f64| (a / b).max(b / a) > EQUAL;
    let mut each: Vec<(&Path, f64)> = Vec::new();
    for (camera, file) in cameras.iter().zip(files) {
        match each.iter().find(|(known, _)| known == file) {
            Some((_, focal)) if is_other(*focal, relative(camera)) => return None,
            Some(_) => {}
            None => each.push((file, relative(camera))),
        }
    }
    let (first, focal) = *each.first()?;
    let (other, found) = *each.iter().find(|(_, found)| is_other(*found, focal))?;
    Some(Problem::note(format!(
        "focal lengths are {focal:.3} of the width in {}, and {found:.3} in {}: if one lens took all photographs, correct one of the files",
        first.display(),
        other.display()
    )))
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
    // Rays have single precision.
    let rounding = f64::from(f32::EPSILON) * first.translation.length();
    let is_there = |c: &Camera| (c.world_from_camera.translation - first.translation).length() <= rounding;
    if !cameras.clone().all(is_there) {
        return None;
    }
    let is_same = cameras.clone().all(|c| c.world_from_camera == first);
    Some(if is_same { Coincidence::Pose } else { Coincidence::Place })
}

/// Whether all cameras stand in one place, as those of a panorama do.
pub fn is_one_place<'a>(cameras: impl Iterator<Item = &'a Camera> + Clone) -> bool {
    coincidence(cameras).is_some()
}

/// The warning about cameras that all stand in one place.
pub(crate) fn one_place() -> Problem {
    Problem::warning(
        "all views are taken from one point: depth cannot be reconstructed, and rays stay straight where no file says what \
         is refractive",
    )
}

/// Notes about rotations that were repaired, and a warning about those that had a scale.
pub(crate) fn repairs(checked: &[CheckedPose]) -> Vec<Problem> {
    let errors: Vec<f64> = checked.iter().filter_map(|c| c.repaired).collect();
    let repaired = errors.iter().copied().reduce(f64::max).map(|worst| {
        let count = errors.len();
        Problem::note(format!(
            "{count} rotations were up to {worst:.1e} away from orthonormal and were repaired"
        ))
    });
    let scales: Vec<f64> = checked.iter().filter_map(|c| c.scale).collect();
    let scaled = scales.first().map(|first| {
        Problem::warning(format!(
            "{} rotations contain a scale ({first:.4} the first), as those of scaled objects do; it is left out, and positions stay as \
             they are",
            scales.len()
        ))
    });
    repaired.into_iter().chain(scaled).collect()
}
