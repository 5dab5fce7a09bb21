//! The frame of a forward-facing capture, from its cameras and the nearest depth.

use super::border::border;
use super::quantile::quantile;
use refraxel_core::{Camera, Projection, Vec3};

/// Optical axes of a forward-facing capture lie within this of their mean [cosine of 35°].
const AXES: f64 = 0.82;
/// Rays this far from the mean axis make no picture that faces forward [cosine of 78°].
const WIDEST: f64 = 0.2;
/// Cameras that stand farther apart than this walk around something [nearest depth].
const APART: f64 = 1.0;
/// Cameras that stand closer together than this see no depth [nearest depth].
const TOGETHER: f64 = 1.0 / 64.0;
/// The grid begins at this share of the nearest depth, and this share of points may be nearer: they are outliers.
const MARGIN: f64 = 0.9;
const OUTLIERS: f64 = 0.005;

/// The frame of cameras that look one way, at something from a known depth on; `None` for other captures. `up` is where the
/// pictures have it.
pub(super) fn projection(
    cameras: &[&Camera],
    up: Vec3<f64>,
    points: &[Vec3<f64>],
    depth_range: Option<[f64; 2]>,
) -> Option<Projection> {
    let mean = |of: &dyn Fn(&Camera) -> Vec3<f64>| {
        cameras.iter().fold(Vec3::zero(), |sum, c| sum + of(c)) / cameras.len().max(1) as f64
    };
    let forward = mean(&Camera::forward);
    if forward.length() < AXES {
        return None;
    }
    let ahead = forward.normalized();
    let right = ahead.cross(up);
    if cameras.iter().any(|c| c.forward().dot(ahead) < AXES) || right.length() < 1e-3 {
        return None;
    }
    let right = right.normalized();
    let (eye, axes) = (mean(&|c| c.world_from_camera.translation), [right, ahead.cross(right), ahead]);
    let local = |v: Vec3<f64>| Vec3::from(axes.map(|axis| axis.dot(v)));
    let places: Vec<Vec3<f64>> =
        cameras.iter().map(|c| local(c.world_from_camera.translation - eye)).collect();
    let extent = |a: usize| {
        let [low, high] = places
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], p| [low.min(p[a]), high.max(p[a])]);
        (low, high - low)
    };
    let near = match depth_range {
        Some([near, _]) => MARGIN * near + extent(2).0,
        None if points.is_empty() => return None,
        None => {
            let depths = points.iter().map(|p| local(*p - eye).z).filter(|z| *z > 0.0);
            MARGIN * quantile(depths, OUTLIERS).unwrap_or(0.0)
        }
    };
    let apart = extent(0).1.max(extent(1).1);
    if near.is_nan() || near <= 0.0 || apart > APART * near || extent(2).1 > APART * near {
        return None;
    }
    let mut edges = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for (camera, place) in cameras.iter().zip(&places) {
        for ray in border(camera) {
            let d = local(ray.direction);
            if d.z < WIDEST {
                return None;
            }
            for a in 0..2 {
                let slope = d[a] / d.z;
                for s in [slope, (place[a] + slope * (near - place.z)) / near] {
                    edges[a] = [edges[a][0].min(s), edges[a][1].max(s)];
                }
            }
        }
    }
    Some(Projection {
        eye: eye.cast(),
        axes: axes.map(|axis| axis.cast()),
        near: near as f32,
        edges: edges.map(|e| e.map(|s| s as f32)),
        baseline: apart.max(TOGETHER * near) as f32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    const UP: Vec3<f64> = Vec3 { x: 0.0, y: 0.0, z: 1.0 };

    /// Cameras on a square of this edge that look along y at a point this far ahead.
    fn square(edge: f64, target: f64) -> Vec<Camera> {
        let eye = |k: usize| vec3((k % 3) as f64 - 1.0, 0.0, (k / 3) as f64 - 1.0) * (0.5 * edge);
        (0..9).map(|k| Camera::look_at(eye(k), vec3(0.0, target, 0.0), UP, 0.8, [120, 90])).collect()
    }

    fn of(cameras: &[Camera], depth_range: Option<[f64; 2]>) -> Option<Projection> {
        projection(&cameras.iter().collect::<Vec<_>>(), UP, &[], depth_range)
    }

    #[test]
    fn a_frame_holds_all_that_its_cameras_see() {
        let cameras = square(0.6, 5.0);
        let frame = of(&cameras, Some([2.0, 9.0])).unwrap();
        assert!((frame.baseline - 0.6).abs() < 1e-6 && (frame.near - 1.8).abs() < 1e-5, "{frame:?}");
        for camera in &cameras {
            for ray in border(camera) {
                for depth in [2.5, 7.0, 1e4] {
                    let p = frame.local(ray.at(depth));
                    for a in 0..2 {
                        let [low, high] = frame.edges[a].map(f64::from);
                        assert!((low - 1e-6..=high + 1e-6).contains(&(p[a] / p.z)), "{p:?} {frame:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn captures_around_something_or_of_unknown_depth_have_none() {
        assert_eq!(of(&square(0.6, 5.0), None), None);
        // As far apart as their subject is near: a walk around it.
        assert_eq!(of(&square(6.0, 5.0), Some([4.0, 9.0])), None);
        let around: Vec<Camera> = (0..12)
            .map(|k| {
                let angle = 0.52 * f64::from(k);
                Camera::look_at(vec3(angle.cos(), angle.sin(), 0.2) * 4.0, Vec3::zero(), UP, 0.8, [90, 90])
            })
            .collect();
        assert_eq!(of(&around, Some([2.0, 9.0])), None);
    }
}
