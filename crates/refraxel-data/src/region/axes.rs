//! What the optical axes say about a capture: where they meet, from how far, which way is up.

use super::quantile::quantile;
use crate::is_one_place;
use refraxel_core::{Camera, Mat3, Vec3, vec3};

/// How the cameras of a capture are arranged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Around something, looking at it.
    Inward,
    /// Side by side, looking the same way.
    Forward,
    /// From within, looking around.
    Outward,
}

/// Position and scale of a capture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Capture {
    /// What the cameras look at; for outward captures, where they stand.
    pub center: Vec3<f64>,
    /// Median distance of the cameras from the centre, > 0.
    pub distance: f64,
    /// Mean upward direction.
    pub up: Vec3<f64>,
    pub kind: Kind,
}

/// Mean forward vectors longer than this belong to axes within about 8° of each other, whose meeting point is noise.
const PARALLEL: f64 = 0.99;
/// Distance of the subject from forward-facing cameras, in their own spread, where nothing better is known.
const FORWARD_DISTANCE: f64 = 4.0;
/// Rounds of re-weighting; each halves the pull of stray axes, more change the centre by less than a percent.
const ROUNDS: usize = 20;

impl Capture {
    /// Measures a capture; needs at least one camera for a meaningful result.
    pub fn of(cameras: &[&Camera]) -> Self {
        let mean = |f: &dyn Fn(&Camera) -> Vec3<f64>| {
            cameras.iter().fold(Vec3::zero(), |sum, c| sum + f(c)) / cameras.len().max(1) as f64
        };
        let up = unit_or_z(mean(&|c| -c.world_from_camera.rotation.columns[1]));
        let (place, forward) = (mean(&|c| c.world_from_camera.translation), mean(&Camera::forward));
        let is_one_place = is_one_place(cameras.iter().copied());
        let met = (!is_one_place && forward.length() < PARALLEL).then(|| meeting_point(cameras)).flatten();
        let ahead = |p: Vec3<f64>| {
            let count = cameras
                .iter()
                .filter(|c| (p - c.world_from_camera.translation).dot(c.forward()) > 0.0)
                .count();
            2 * count > cameras.len()
        };
        // Pictures from one place have no size: any will do.
        let spread = if is_one_place { 1.0 } else { reach(cameras, place) };
        match met.filter(|p| ahead(*p)) {
            Some(center) => Self { center, distance: reach(cameras, center), up, kind: Kind::Inward },
            None if forward.length() > 0.5 => {
                let distance = FORWARD_DISTANCE * spread;
                Self { center: place + forward.normalized() * distance, distance, up, kind: Kind::Forward }
            }
            None => Self { center: place, distance: 2.0 * spread, up, kind: Kind::Outward },
        }
    }

    /// The camera nearest to the middle of all cameras.
    pub fn middle<'a>(&self, cameras: &[&'a Camera]) -> &'a Camera {
        let place = |c: &Camera| c.world_from_camera.translation;
        let sum = cameras.iter().fold(Vec3::zero(), |sum, c| sum + place(c));
        let mean = sum / cameras.len() as f64;
        let mut sorted = cameras.to_vec();
        sorted.sort_by(|a, b| (place(a) - mean).length().total_cmp(&(place(b) - mean).length()));
        sorted[0]
    }
}

fn median_distance(cameras: &[&Camera], point: Vec3<f64>) -> f64 {
    quantile(cameras.iter().map(|c| (c.world_from_camera.translation - point).length()), 0.5).unwrap_or(0.0)
}

/// Median distance of the cameras from a point; the largest one where most of them stand there.
fn reach(cameras: &[&Camera], point: Vec3<f64>) -> f64 {
    let median = median_distance(cameras, point);
    let largest =
        || cameras.iter().map(|c| (c.world_from_camera.translation - point).length()).fold(0.0, f64::max);
    if median > 0.0 { median } else { largest() }
}

/// The point with the least sum of distances to all axes (re-weighted least squares, robust like a median).
/// `None` when the axes are parallel.
fn meeting_point(cameras: &[&Camera]) -> Option<Vec3<f64>> {
    let mut weights = vec![1.0; cameras.len()];
    let mut point = Vec3::zero();
    for _ in 0..ROUNDS {
        let (mut a, mut b) = ([[0.0; 3]; 3], Vec3::zero());
        for (camera, &weight) in cameras.iter().zip(&weights) {
            // Squared distance to the axis: |(1 − ddᵀ)(x − o)|².
            let (d, o) = (camera.forward(), camera.world_from_camera.translation);
            for r in 0..3 {
                for c in 0..3 {
                    a[r][c] += weight * (f64::from(u8::from(r == c)) - d[r] * d[c]);
                }
            }
            b += (o - d * d.dot(o)) * weight;
        }
        point = solve(&Mat3::from_rows(a), b)?;
        let floor = 1e-3 * median_distance(cameras, point);
        for (camera, weight) in cameras.iter().zip(&mut weights) {
            let offset = point - camera.world_from_camera.translation;
            let distance = (offset - camera.forward() * camera.forward().dot(offset)).length();
            *weight = 1.0 / distance.max(floor).max(f64::MIN_POSITIVE);
        }
    }
    point.is_finite().then_some(point)
}

/// x with a x = b, by Cramer's rule; `None` for a singular matrix.
fn solve(a: &Mat3<f64>, b: Vec3<f64>) -> Option<Vec3<f64>> {
    let [x, y, z] = a.columns;
    let det = a.determinant();
    let scale = x.length() * y.length() * z.length();
    let with = |columns| Mat3 { columns }.determinant() / det;
    (det.abs() > 1e-9 * scale).then(|| vec3(with([b, y, z]), with([x, b, z]), with([x, y, b])))
}

fn unit_or_z(v: Vec3<f64>) -> Vec3<f64> {
    if v.length() > 1e-3 { v.normalized() } else { vec3(0.0, 0.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(target: Vec3<f64>, count: usize) -> Vec<Camera> {
        let eye = |i: usize| {
            let angle = i as f64 * 2.4;
            target + vec3(3.0 * angle.cos(), 3.0 * angle.sin(), 1.0 + 0.05 * i as f64)
        };
        (0..count).map(|i| Camera::look_at(eye(i), target, vec3(0.0, 0.0, 1.0), 0.7, [100, 80])).collect()
    }

    #[test]
    fn axes_meet_at_the_target_even_when_a_third_look_elsewhere() {
        let target = vec3(1.0, -2.0, 0.5);
        let mut cameras = ring(target, 30);
        for i in (0..30).step_by(3) {
            let eye = cameras[i].world_from_camera.translation;
            cameras[i] = Camera::look_at(eye, vec3(9.0, 4.0, -3.0), vec3(0.0, 0.0, 1.0), 0.7, [100, 80]);
        }
        let capture = Capture::of(&cameras.iter().collect::<Vec<_>>());
        assert_eq!(capture.kind, Kind::Inward);
        assert!((capture.center - target).length() < 0.02, "{:?}", capture.center);
        assert!(capture.up.dot(vec3(0.0, 0.0, 1.0)) > 0.9);
    }

    #[test]
    fn parallel_and_outward_cameras_are_recognised() {
        let up = vec3(0.0, 1.0, 0.0);
        let row = |i: i32| {
            let eye = vec3(f64::from(i), 0.0, 0.0);
            Camera::look_at(eye, eye + vec3(0.0, 0.0, 1.0), up, 0.7, [90, 60])
        };
        let side_by_side: Vec<Camera> = (0..5).map(row).collect();
        let capture = Capture::of(&side_by_side.iter().collect::<Vec<_>>());
        assert_eq!(capture.kind, Kind::Forward);
        assert!(capture.center.z > 2.0);
        let around: Vec<Camera> = (0..12)
            .map(|i| {
                let d = vec3(f64::from(i).cos(), 0.0, f64::from(i).sin());
                Camera::look_at(d * 0.5, d * 3.0, up, 0.7, [90, 60])
            })
            .collect();
        assert_eq!(Capture::of(&around.iter().collect::<Vec<_>>()).kind, Kind::Outward);
    }

    #[test]
    fn a_panorama_from_a_tripod_has_a_size() {
        let place = vec3(1.0, -2.0, 0.5);
        for (count, kind) in [(12, Kind::Outward), (4, Kind::Forward)] {
            let towards = |i: i32| vec3((0.5 * f64::from(i)).cos(), (0.5 * f64::from(i)).sin(), 0.1);
            let camera = |i| Camera::look_at(place, place + towards(i), vec3(0.0, 0.0, 1.0), 0.7, [90, 60]);
            let cameras: Vec<Camera> = (0..count).map(camera).collect();
            let capture = Capture::of(&cameras.iter().collect::<Vec<_>>());
            assert_eq!(capture.kind, kind);
            assert!(capture.distance >= 1.0 && capture.center.is_finite(), "{capture:?}");
        }
    }
}
