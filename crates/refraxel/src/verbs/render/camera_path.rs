//! Camera paths: files of nerfstudio, and smooth curves through keyframes.

use crate::exit::{Exit, Failure};
use crate::verbs::files::read_text;
use refraxel_core::{Camera, Lens, Mat3, Pose, Vec3, vec3};
use refraxel_data::NamedCamera;
use serde::Deserialize;
use std::path::Path;

/// Frames of a path at most.
pub const MOST_FRAMES: usize = 100_000;
/// A camera is nearer to the origin [scene unit]: rays are in single precision.
const FARTHEST: f64 = 1e9;

/// A path as it is read.
pub struct CameraPath {
    /// Its frames.
    pub cameras: Vec<NamedCamera>,
    /// Frames per second, where the file says it.
    pub fps: Option<f64>,
}

/// `camera_path.json` of nerfstudio, as far as it counts.
#[derive(Deserialize)]
struct File {
    #[serde(default)]
    camera_type: Option<String>,
    render_width: u32,
    render_height: u32,
    #[serde(default)]
    fps: Option<f64>,
    camera_path: Vec<FrameOfFile>,
}

#[derive(Deserialize)]
struct FrameOfFile {
    /// 4 × 4, row by row; the axes of the camera are right, up and backward.
    camera_to_world: Vec<f64>,
    /// Vertical field of view [degree].
    fov: f64,
}

/// `dataparser_transforms.json` of nerfstudio: its world is `scale * (transform * x)`.
#[derive(Deserialize)]
struct Transform {
    transform: [[f64; 4]; 3],
    scale: f64,
}

/// Reads a `camera_path.json`. Its world is that of the dataset; with `transform`, the `dataparser_transforms.json` of the
/// same run of nerfstudio, it is nerfstudio's own.
pub fn read(path: &Path, transform: Option<&Path>) -> Result<CameraPath, Failure> {
    let file: File = parse(path)?;
    let wrong = |what: String| Exit::BadInput.because(format!("{}: {what}", path.display()));
    if let Some(kind) = file.camera_type.as_ref().filter(|kind| *kind != "perspective") {
        return Err(wrong(format!("camera_type: found {kind:?}; expected \"perspective\"")));
    }
    if file.camera_path.is_empty() {
        return Err(wrong("camera_path: it has no frames; expected at least one".to_owned()));
    }
    let size = [file.render_width, file.render_height];
    if let Some(edge) = size.iter().find(|n| !(1..=16_384).contains(*n)) {
        return Err(wrong(format!("render_width, render_height: found {edge}; expected 1 to 16384 pixels")));
    }
    if file.camera_path.len() > MOST_FRAMES {
        let found = file.camera_path.len();
        return Err(wrong(format!("camera_path: it has {found} frames; expected at most {MOST_FRAMES}")));
    }
    if let Some(fps) = file.fps.filter(|fps| !(1.0..=120.0).contains(fps)) {
        return Err(wrong(format!("fps: found {fps}; expected 1 to 120 frames per second")));
    }
    let undo = transform.map(inverse).transpose()?;
    let camera = |(k, frame): (usize, &FrameOfFile)| {
        let camera = frame.camera(size).map_err(|what| wrong(format!("camera_path[{k}].{what}")))?;
        let camera = undo.as_ref().map_or(camera, |undo| undo.apply(&camera));
        let far = camera.world_from_camera.translation.length();
        if far.is_nan() || far >= FARTHEST {
            return Err(wrong(format!(
                "camera_path[{k}].camera_to_world: the camera is {far} away from the origin"
            )));
        }
        Ok(NamedCamera { name: format!("{k:04}"), camera })
    };
    let cameras: Result<Vec<NamedCamera>, Failure> =
        file.camera_path.iter().enumerate().map(camera).collect();
    Ok(CameraPath { cameras: cameras?, fps: file.fps })
}

fn parse<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T, Failure> {
    let shown = path.display();
    let text =
        read_text(path).map_err(|error| Exit::BadInput.because(format!("cannot read {shown}: {error}")))?;
    serde_json::from_str(&text).map_err(|error| {
        Exit::BadInput.because(format!("{shown}: this is no such file of nerfstudio: {error}"))
    })
}

impl FrameOfFile {
    fn camera(&self, [width, height]: [u32; 2]) -> Result<Camera, String> {
        if !(0.1..=175.0).contains(&self.fov) {
            return Err(format!("fov: found {}; expected 0.1 to 175 degrees", self.fov));
        }
        let found = self.camera_to_world.len();
        let [r0, r1, r2] = match self.camera_to_world[..] {
            [a, b, c, d, e, f, g, h, i, j, k, l, ..] if found == 16 || found == 12 => {
                [[a, b, c, d], [e, f, g, h], [i, j, k, l]]
            }
            _ => return Err(format!("camera_to_world: found {found} numbers; expected 16, row by row")),
        };
        let column = |k: usize| vec3(r0[k], r1[k], r2[k]);
        let scale = column(0).length();
        let [right, up, backward] = [0, 1, 2].map(|k| column(k) * (1.0 / scale));
        let near = |x: f64, y: f64| (x - y).abs() < 1e-3;
        let is_rotation = near(up.length(), 1.0) && near(right.cross(up).dot(backward), 1.0);
        if !is_rotation || !column(3).length().is_finite() {
            return Err("camera_to_world: its left 3 × 3 part is no rotation".to_owned());
        }
        let focal = 0.5 * f64::from(height) / (0.5 * self.fov.to_radians()).tan();
        let rotation = orthonormal([right, -up, -backward]);
        Ok(Camera {
            width,
            height,
            focal: [focal; 2],
            center: [0.5 * f64::from(width), 0.5 * f64::from(height)],
            lens: Lens::Pinhole,
            world_from_camera: Pose { rotation, translation: column(3) },
        })
    }
}

fn orthonormal([right, _, forward]: [Vec3<f64>; 3]) -> Mat3<f64> {
    let forward = forward.normalized();
    let right = (right - forward * right.dot(forward)).normalized();
    Mat3 { columns: [right, forward.cross(right), forward] }
}

/// From nerfstudio's world to that of the dataset.
struct Inverse {
    rotation: Mat3<f64>,
    translation: Vec3<f64>,
    scale: f64,
}

fn inverse(path: &Path) -> Result<Inverse, Failure> {
    let Transform { transform, scale } = parse(path)?;
    let column = |k: usize| vec3(transform[0][k], transform[1][k], transform[2][k]);
    let [x, y, z] = [column(0), column(1), column(2)];
    let near = |x: f64, y: f64| (x - y).abs() < 1e-3;
    let is_rotation = near(x.length(), 1.0) && near(y.length(), 1.0) && near(x.cross(y).dot(z), 1.0);
    if !(is_rotation && scale > 0.0 && scale.is_finite()) {
        let shown = path.display();
        return Err(Exit::BadInput.because(format!(
            "{shown}: expected `transform` with a rotation in its left 3 × 3 part, and `scale` above 0"
        )));
    }
    Ok(Inverse { rotation: Mat3 { columns: [x, y, z] }.transpose(), translation: column(3), scale })
}

impl Inverse {
    fn apply(&self, camera: &Camera) -> Camera {
        let Pose { rotation, translation } = camera.world_from_camera;
        let columns = rotation.columns.map(|axis| self.rotation * axis);
        let translation = self.rotation * (translation * (1.0 / self.scale) - self.translation);
        Camera { world_from_camera: Pose { rotation: Mat3 { columns }, translation }, ..*camera }
    }
}

/// `count` cameras on a smooth curve through keyframes, at equal steps between two of them: places on a Catmull–Rom spline,
/// which passes through all keyframes, and axes that turn at a constant rate from one keyframe to the next. Size and lens are those of
/// the first keyframe, focal lengths are interpolated.
///
/// # Panics
/// If there are no keyframes.
pub fn through(keys: &[NamedCamera], count: usize) -> Vec<NamedCamera> {
    let last = keys.len() - 1;
    let size = [keys[0].camera.width, keys[0].camera.height];
    let cameras: Vec<Camera> = keys.iter().map(|key| fitted(&key.camera, size)).collect();
    let key = |i: usize| &cameras[i.min(last)];
    let at = |k: usize| {
        let place = last as f64 * k as f64 / (count.max(2) - 1) as f64;
        let i = (place as usize).min(last.saturating_sub(1));
        let t = place - i as f64;
        let (from, to) = (key(i), key(i + 1));
        let around =
            [key(i.saturating_sub(1)), from, to, key(i + 2)].map(|c| c.world_from_camera.translation);
        let rotation = turned(&from.world_from_camera.rotation, &to.world_from_camera.rotation, t);
        let focal = [0, 1].map(|k| from.focal[k] * (1.0 - t) + to.focal[k] * t);
        let world_from_camera = Pose { rotation, translation: spline(around, t) };
        NamedCamera { name: format!("{k:04}"), camera: Camera { focal, world_from_camera, ..*key(0) } }
    };
    (0..count).map(at).collect()
}

/// Catmull–Rom spline between the second and the third point.
///
/// Source: Catmull and Rom 1974, A class of local interpolating splines, with tension ½.
fn spline([a, b, c, d]: [Vec3<f64>; 4], t: f64) -> Vec3<f64> {
    let (t2, t3) = (t * t, t * t * t);
    (a * (-t3 + 2.0 * t2 - t)
        + b * (3.0 * t3 - 5.0 * t2 + 2.0)
        + c * (-3.0 * t3 + 4.0 * t2 + t)
        + d * (t3 - t2))
        * 0.5
}

/// The share `t` of the turn from one rotation to another, about its axis.
fn turned(from: &Mat3<f64>, to: &Mat3<f64>, t: f64) -> Mat3<f64> {
    // The turn to * fromᵀ: its axis and angle from the antisymmetric part, 2 sin(angle) axis, and the trace, 1 + 2 cos(angle).
    let [a, b] = [from.columns, to.columns];
    let double_sine = a.iter().zip(&b).fold(Vec3::zero(), |sum, (a, b)| sum + a.cross(*b));
    let cosine = 0.5 * (a.iter().zip(&b).map(|(a, b)| a.dot(*b)).sum::<f64>() - 1.0);
    let angle = (0.5 * double_sine.length()).atan2(cosine);
    let axis = if double_sine.length() > 1e-9 { double_sine.normalized() } else { half_turn_axis(&a, &b) };
    orthonormal((Mat3::turning(axis * (t * angle)) * *from).columns)
}

/// An axis that a half turn leaves: the longest of v + Rv; any for no turn at all.
fn half_turn_axis(a: &[Vec3<f64>; 3], b: &[Vec3<f64>; 3]) -> Vec3<f64> {
    let sums = a.iter().zip(b).map(|(a, b)| *a + *b);
    let longest = sums.max_by(|x, y| x.length().total_cmp(&y.length()));
    longest.filter(|v| v.length() > 1e-9).map_or(vec3(0.0, 0.0, 1.0), |v| v.normalized())
}

/// The camera for pictures of another size: all that it sees is in them, and more where the new shape is wider or taller.
pub fn fitted(camera: &Camera, [width, height]: [u32; 2]) -> Camera {
    let [w, h] = [f64::from(width), f64::from(height)];
    let scale = (w / f64::from(camera.width)).min(h / f64::from(camera.height));
    let center = [
        0.5 * w + scale * (camera.center[0] - 0.5 * f64::from(camera.width)),
        0.5 * h + scale * (camera.center[1] - 0.5 * f64::from(camera.height)),
    ];
    Camera { width, height, focal: camera.focal.map(|f| f * scale), center, ..*camera }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn camera(eye: Vec3<f64>) -> Camera {
        Camera::look_at(eye, vec3(0.1, 0.2, 0.3), vec3(0.0, 0.0, 1.0), 0.7, [60, 40])
    }

    fn named(viewer: &[Vec3<f64>]) -> Vec<NamedCamera> {
        viewer.iter().map(|&eye| NamedCamera { name: String::new(), camera: camera(eye) }).collect()
    }

    fn is_near(a: &Camera, b: &Camera, least: f64) -> bool {
        let rays = |c: &Camera| [(3.0, 4.0), (50.0, 30.0)].map(|(u, v)| c.ray(u, v).unwrap());
        let near = |(a, b): (refraxel_core::Ray<f64>, refraxel_core::Ray<f64>)| {
            (a.origin - b.origin).length() < least && (a.direction - b.direction).length() < least
        };
        rays(a).into_iter().zip(rays(b)).all(near)
    }

    /// A camera as nerfstudio writes it.
    fn frame(c: &Camera) -> serde_json::Value {
        let m: Vec<f64> = refraxel_data::synth::opengl_matrix(c).concat();
        let fov = 2.0 * (0.5 * f64::from(c.height) / c.focal[1]).atan().to_degrees();
        json!({ "camera_to_world": m, "fov": fov, "aspect": 1.5 })
    }

    fn written(value: &serde_json::Value) -> tempfile::NamedTempFile {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), value.to_string()).unwrap();
        file
    }

    #[test]
    fn a_path_of_nerfstudio_is_read_as_it_was_meant() {
        let c = camera(vec3(2.0, -1.0, 0.5));
        let value = json!({ "camera_type": "perspective", "render_width": 60, "render_height": 40, "fps": 30,
            "seconds": 1, "camera_path": [frame(&c), frame(&c)], "keyframes": [] });
        let path = read(written(&value).path(), None).unwrap();
        assert_eq!((path.cameras.len(), path.fps), (2, Some(30.0)));
        assert!(is_near(&path.cameras[1].camera, &c, 1e-9));
    }

    #[test]
    fn the_transform_of_a_dataparser_is_undone() {
        // x' = 0.5 (R x + t) with R a quarter turn about z.
        let transform = json!({ "transform": [[0, -1, 0, 3], [1, 0, 0, -2], [0, 0, 1, 1]], "scale": 0.5 });
        let c = camera(vec3(2.0, -1.0, 0.5));
        let turn = |v: Vec3<f64>| vec3(-v.y, v.x, v.z);
        let Pose { rotation, translation } = c.world_from_camera;
        let there = Camera {
            world_from_camera: Pose {
                rotation: Mat3 { columns: rotation.columns.map(turn) },
                translation: (turn(translation) + vec3(3.0, -2.0, 1.0)) * 0.5,
            },
            ..c
        };
        let value = json!({ "render_width": 60, "render_height": 40, "camera_path": [frame(&there)] });
        let path = read(written(&value).path(), Some(written(&transform).path())).unwrap();
        assert!(is_near(&path.cameras[0].camera, &c, 1e-9));
    }

    #[test]
    fn what_is_no_path_is_refused_by_name() {
        let good = frame(&camera(vec3(2.0, 0.0, 0.0)));
        let with = |key: &str, value: serde_json::Value| {
            let mut frame = good.clone();
            frame[key] = value;
            json!({ "render_width": 60, "render_height": 40, "camera_path": [frame] })
        };
        for (value, word) in [
            (with("fov", json!(0)), "camera_path[0].fov"),
            (with("camera_to_world", json!([1, 2])), "found 2 numbers"),
            (with("camera_to_world", json!(vec![0.0; 16])), "no rotation"),
            (json!({ "render_width": 60, "render_height": 40, "camera_path": [] }), "no frames"),
            (json!({ "render_width": 0, "render_height": 40, "camera_path": [good] }), "render_width"),
            (json!({ "frames": [] }), "no such file of nerfstudio"),
            (json!({ "render_width": 6, "render_height": 4, "fps": 1e9, "camera_path": [good] }), "fps"),
            (with("camera_to_world", json!([1, 0, 0, 1e12, 0, 1, 0, 0, 0, 0, 1, 0])), "away from the origin"),
            (
                json!({ "camera_type": "fisheye", "render_width": 6, "render_height": 4, "camera_path": [good] }),
                "camera_type",
            ),
        ] {
            let report = read(written(&value).path(), None).err().expect("refused").report();
            assert!(report.contains(word), "{word}: {report}");
        }
    }

    #[test]
    fn a_curve_passes_through_its_keyframes() {
        let keys = named(&[vec3(2.0, 0.0, 0.5), vec3(0.0, 2.0, 1.0), vec3(-2.0, 0.5, 0.2)]);
        let path = through(&keys, 21);
        assert_eq!(path.len(), 21);
        for (key, at) in keys.iter().zip([0, 10, 20]) {
            assert!(is_near(&path[at].camera, &key.camera, 1e-6), "{at}");
        }
        let step = |k: usize| {
            let place = |k: usize| path[k].camera.world_from_camera.translation;
            (place(k + 1) - place(k)).length()
        };
        assert!((0..20).all(|k| step(k) < 0.6), "it does not jump");
        assert!(through(&keys[..1], 3).iter().all(|c| is_near(&c.camera, &keys[0].camera, 1e-9)));
    }

    #[test]
    fn half_of_a_turn_is_a_turn_of_half_the_angle() {
        let x = Mat3 { columns: [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)] };
        let quarter = Mat3 { columns: [vec3(0.0, 1.0, 0.0), vec3(-1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)] };
        let half = turned(&x, &quarter, 0.5).columns[0];
        assert!((half - vec3(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0)).length() < 1e-12, "{half:?}");
        let opposite = Mat3 { columns: [vec3(-1.0, 0.0, 0.0), vec3(0.0, -1.0, 0.0), vec3(0.0, 0.0, 1.0)] };
        let end = turned(&x, &opposite, 1.0).columns;
        assert!((end[0] - opposite.columns[0]).length() < 1e-9, "{end:?}");
    }

    #[test]
    fn another_shape_shows_all_that_was_seen() {
        let c = camera(vec3(2.0, 0.0, 0.5));
        let wide = fitted(&c, [120, 40]);
        let (a, b) = (c.ray(0.0, 0.0).unwrap(), wide.ray(30.0, 0.0).unwrap());
        assert!((a.direction - b.direction).length() < 1e-12);
    }
}
