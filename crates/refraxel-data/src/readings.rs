//! Whether poses are meant as they are read: in a rigid scene, neighbouring photographs show the same things where poses say.
//!
//! Files state poses in many conventions, and a pose in a wrong one is a pose as well. Where photographs contradict their poses and
//! another convention makes them agree, a warning names it.

use crate::looks::{Look, chosen, look_at};
use crate::pose::{quaternion_of_rotation, rotation_of_quaternion};
use crate::rigid::{self, Posed, RIGID, Score};
use crate::{Format, PhotoSource, Problem, View};
use refraxel_core::{Camera, Mat3, Pose};
use std::collections::BTreeMap;

/// Shorter edge of pictures whose patches say something [pixel].
const LEAST_EDGE: u32 = 48;
/// Cameras that are compared are this share of the width of where all stand apart, at least: nearer ones see nearly the same, and so
/// they do in any reading. Measured on seven captures: a wrong reading scores up to 0.22 with nearest neighbours, and up to 0.17
/// with these, beside 0.21 to 0.33 of the right one.
const AWAY: f64 = 0.1;
/// Poses that score this much are right.
const SURE: f64 = 0.2;
/// By how many standard errors, and by which factor, another reading has to be better.
const ERRORS: f64 = 4.0;
const FACTOR: f64 = 1.3;
/// Fewest views of which that can be said: neighbours stand close to each other.
const FEWEST_VIEWS: usize = 12;

/// Another way to read a camera.
struct Reading {
    /// What is meant then: "the poses are …".
    says: &'static str,
    camera: fn(&Camera) -> Camera,
}

/// A warning where poses contradict the photographs that were looked at. Where these have masks, what is left out may well move.
pub(crate) fn doubt(format: Format, views: &[View], looks: &[Look], are_masked: bool) -> Option<Problem> {
    if looks.iter().any(|look| look.small.width.min(look.small.height) < LEAST_EDGE) {
        return None;
    }
    let mut known = BTreeMap::new();
    let mut score = |reading: &Reading| score(reading, views, looks, &mut known);
    let as_read = score(&Reading { says: "they are as stated", camera: |c| *c });
    if as_read.is_some_and(|s| s.mean > SURE) {
        return None;
    }
    let near = rigid::score(&looks.iter().map(Look::posed).collect::<Vec<_>>(), 0.0)?;
    let as_read = as_read.unwrap_or(near);
    let others = readings(format).into_iter().filter_map(|reading| Some((score(&reading)?, reading)));
    let best = others.max_by(|(a, _), (b, _)| a.mean.total_cmp(&b.mean));
    let agreement = |s: Score| format!("gain of correlation {:.2} ± {:.2}", s.mean, s.error);
    if let Some((score, reading)) = best.filter(|(s, _)| is_surely(*s, as_read)) {
        return Some(Problem::warning(format!(
            "the photographs contradict their cameras, and agree if {} ({}, as stated {:.2}): export the cameras again, or convert them",
            reading.says,
            agreement(score),
            as_read.mean
        )));
    }
    // No better than by chance, and surely not as a rigid scene.
    let agree = near.is_rigid() || near.mean > 2.0 * near.error || near.mean + 2.0 * near.error >= RIGID;
    (!agree && !are_masked && views.len() >= FEWEST_VIEWS).then(|| {
        Problem::warning(format!(
            "neighbouring photographs do not show the same things where their cameras say ({}): their poses may be those of other \
             photographs, or the background may move with the camera, as behind a turntable; compare names and poses, or give masks",
            agreement(near)
        ))
    })
}

/// Whether the first score is that of a rigid scene, and the other one of a wrong reading.
fn is_surely(score: Score, than: Score) -> bool {
    score.is_rigid() && score.is_above(than, ERRORS) && score.mean > FACTOR * than.mean
}

/// The score of a reading, by photographs that were looked at and, where others are neighbours then, by those.
fn score(
    reading: &Reading,
    views: &[View],
    looks: &[Look],
    known: &mut BTreeMap<usize, Option<Look>>,
) -> Option<Score> {
    let files: Vec<usize> =
        (0..views.len()).filter(|&k| matches!(views[k].source, PhotoSource::Files { .. })).collect();
    let cameras: Vec<Camera> = views.iter().map(|view| (reading.camera)(&view.camera)).collect();
    let place = |k: usize| cameras[k].world_from_camera.translation;
    let away = AWAY * rigid::distance_of(files.iter().map(|&k| place(k)));
    let chosen = chosen(place, &files, away);
    let first = |k: &usize| looks.iter().find(|look| look.view == *k);
    let missing: Vec<usize> =
        chosen.iter().copied().filter(|k| first(k).is_none() && !known.contains_key(k)).collect();
    known.extend(missing.iter().map(|&k| (k, None)));
    known.extend(look_at(views, &missing).into_iter().map(|look| (look.view, Some(look))));
    let looks: Vec<&Look> =
        chosen.iter().filter_map(|k| first(k).or_else(|| known.get(k)?.as_ref())).collect();
    let small = |look: &&Look| cameras[look.view].resized(look.small.width, look.small.height);
    let cameras: Vec<Camera> = looks.iter().map(small).collect();
    let posed = looks.iter().zip(&cameras).map(|(look, camera)| Posed { image: &look.small, camera });
    rigid::score(&posed.collect::<Vec<_>>(), AWAY)
}

/// Readings that differ by more than a motion of the whole scene.
fn readings(format: Format) -> Vec<Reading> {
    let of_poses = if format == Format::Colmap { of_colmap() } else { of_matrices() };
    of_pictures().into_iter().chain(of_poses).collect()
}

fn reading(says: &'static str, camera: fn(&Camera) -> Camera) -> Reading {
    Reading { says, camera }
}

/// Other axes of the camera, pictures that were turned or mirrored, and other focal lengths.
fn of_pictures() -> Vec<Reading> {
    vec![
        reading(
            "the other camera axes are meant (right, down, forward of OpenCV, or right, up, back of OpenGL)",
            |c| posed(c, |p| turned(p, OTHER_AXES)),
        ),
        reading("the pictures are turned by half a turn", |c| posed(c, |p| turned(p, [-1.0, -1.0, 1.0]))),
        reading("camera axes are left, up and forward, as those of PyTorch3D", |c| {
            posed(c, |p| turned(p, [-1.0, 1.0, -1.0]))
        }),
        reading("the pictures are turned by a quarter turn to the left", |c| quarter(c, 1.0)),
        reading("the pictures are turned by a quarter turn to the right", |c| quarter(c, -1.0)),
        reading("the pictures are mirrored from left to right", |c| {
            posed(c, |p| turned(p, [-1.0, 1.0, 1.0]))
        }),
        reading("the pictures are mirrored from top to bottom", |c| {
            posed(c, |p| turned(p, [1.0, -1.0, 1.0]))
        }),
        reading("the focal length is half of what is stated, or the pictures are twice as large", |c| {
            focal(c, 0.5)
        }),
        reading("the focal length is twice what is stated, or the pictures are half as large", |c| {
            focal(c, 2.0)
        }),
    ]
}

/// Other ways to read the quaternions and translations of COLMAP.
fn of_colmap() -> Vec<Reading> {
    vec![
        reading("the poses lead from camera to world", |c| posed(c, inverse)),
        reading("the poses lead from camera to world, with the axes of OpenGL", |c| {
            posed(c, |p| turned(inverse(p), OTHER_AXES))
        }),
        reading("quaternions are (x, y, z, w) and not (w, x, y, z)", |c| posed(c, scalar_last)),
        reading("the translations are the positions of the cameras", |c| posed(c, position_for_translation)),
    ]
}

/// Other ways to read matrices from camera to world.
fn of_matrices() -> Vec<Reading> {
    vec![
        reading("the poses lead from world to camera, with the axes of OpenCV", |c| posed(c, inverse)),
        reading("the poses lead from world to camera", |c| posed(c, |p| turned(inverse(p), OTHER_AXES))),
        reading("rotations are those from camera to world, and positions from world to camera", |c| {
            posed(c, |p| Pose { translation: -(p.rotation * p.translation), ..p })
        }),
        reading("rotations are those from world to camera, and positions from camera to world", |c| {
            posed(c, |p| turned(transposed(turned(p, OTHER_AXES)), OTHER_AXES))
        }),
        reading(
            "rotations are those from world to camera, and positions from camera to world, with the axes of OpenCV",
            |c| posed(c, transposed),
        ),
        reading(
            "coordinates are left-handed, with camera axes right, up and forward, as those of Unity",
            |c| posed(c, |p| turned(p, [1.0, 1.0, -1.0])),
        ),
    ]
}

/// From the axes of OpenGL to those of OpenCV, and back.
const OTHER_AXES: [f64; 3] = [1.0, -1.0, -1.0];

fn posed(camera: &Camera, pose: impl Fn(Pose) -> Pose) -> Camera {
    Camera { world_from_camera: pose(camera.world_from_camera), ..*camera }
}

fn focal(camera: &Camera, factor: f64) -> Camera {
    Camera { focal: camera.focal.map(|f| f * factor), ..*camera }
}

fn inverse(pose: Pose) -> Pose {
    let rotation = pose.rotation.transpose();
    Pose { rotation, translation: -(rotation * pose.translation) }
}

/// With axes of the camera that point along or against its own.
fn turned(pose: Pose, [x, y, z]: [f64; 3]) -> Pose {
    let [right, down, forward] = pose.rotation.columns;
    Pose { rotation: Mat3 { columns: [right * x, down * y, forward * z] }, ..pose }
}

/// Of a picture that was turned by a quarter turn after it was posed: to the left for 1, to the right for -1.
fn quarter(camera: &Camera, side: f64) -> Camera {
    posed(camera, |p| {
        let [right, down, forward] = p.rotation.columns;
        Pose { rotation: Mat3 { columns: [down * side, right * -side, forward] }, ..p }
    })
}

/// With the inverse rotation, in the same place.
fn transposed(pose: Pose) -> Pose {
    Pose { rotation: pose.rotation.transpose(), ..pose }
}

/// The pose of a COLMAP file whose translation was taken for that from world to camera, and is the camera's position.
fn position_for_translation(pose: Pose) -> Pose {
    Pose { translation: -(pose.rotation.transpose() * pose.translation), ..pose }
}

/// The pose of a COLMAP file whose quaternion was taken for (w, x, y, z).
fn scalar_last(pose: Pose) -> Pose {
    let Pose { rotation, translation } = inverse(pose);
    let [w, x, y, z] = quaternion_of_rotation(&rotation);
    let meant = rotation_of_quaternion([z, w, x, y]).unwrap_or(rotation);
    inverse(Pose { rotation: meant, translation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::Vec3;

    fn some() -> Pose {
        let length = (0.09_f64 + 0.25 + 0.04 + 0.49).sqrt();
        let rotation = rotation_of_quaternion([0.3, -0.5, 0.2, 0.7].map(|v| v / length)).unwrap();
        Pose { rotation, translation: Vec3::new(0.4, -2.0, 3.0) }
    }

    fn is_same(a: Pose, b: Pose) -> bool {
        let columns = (0..3).map(|c| (a.rotation.columns[c] - b.rotation.columns[c]).length()).sum::<f64>();
        columns + (a.translation - b.translation).length() < 1e-12
    }

    #[test]
    fn a_rotation_gives_its_quaternion() {
        for q in [[0.5, 0.5, -0.5, 0.5], [0.1, 0.7, 0.1, 0.7], [0.0, 0.0, 0.6, 0.8], [1.0, 0.0, 0.0, 0.0]] {
            let rotation = rotation_of_quaternion(q).unwrap();
            let again = rotation_of_quaternion(quaternion_of_rotation(&rotation)).unwrap();
            let posed = |rotation| Pose { rotation, translation: Vec3::splat(0.0) };
            assert!(is_same(posed(rotation), posed(again)), "{q:?}");
        }
    }

    #[test]
    fn a_quaternion_with_its_scalar_last_is_read_as_it_was_meant() {
        let meant = some();
        let file = inverse(meant);
        let [w, x, y, z] = quaternion_of_rotation(&file.rotation);
        let misread = Pose { rotation: rotation_of_quaternion([x, y, z, w]).unwrap(), ..file };
        assert!(is_same(scalar_last(inverse(misread)), meant));
    }

    #[test]
    fn a_position_for_a_translation_is_read_as_it_was_meant() {
        let meant = some();
        let misread = inverse(Pose { translation: meant.translation, ..inverse(meant) });
        assert!(is_same(position_for_translation(misread), meant));
    }

    #[test]
    fn readings_that_undo_themselves_do() {
        assert!(is_same(inverse(inverse(some())), some()));
        assert!(is_same(turned(turned(some(), [1.0, -1.0, -1.0]), [1.0, -1.0, -1.0]), some()));
    }

    #[test]
    fn a_point_is_seen_where_a_quarter_turn_of_the_picture_takes_it() {
        let up = Vec3::new(0.0, 0.0, 1.0);
        let camera = Camera::look_at(Vec3::new(3.0, 1.0, 2.0), Vec3::zero(), up, 1.0, [8, 8]);
        let point = Vec3::new(0.3, -0.4, 0.5);
        let [u, v] = camera.project(point).unwrap();
        for (side, [x, y]) in [(1.0, [v, 8.0 - u]), (-1.0, [8.0 - v, u])] {
            let [a, b] = quarter(&camera, side).project(point).unwrap();
            assert!((a - x).hypot(b - y) < 1e-12, "{side}: {a} {b}, {x} {y}");
        }
    }
}
