//! The cameras of a render: an orbit like the capture, or those of a file.

use super::camera_path;
use crate::cli::RenderArgs;
use crate::exit::Failure;
use crate::verbs::dataset::data_failure;
use crate::verbs::loaded::Loaded;
use crate::verbs::reopen::reopen;
use refraxel_core::{Camera, Lens, Vec3};
use refraxel_data::synth::opengl_matrix;
use refraxel_data::{NamedCamera, OpenOptions, open_cameras, quantile, scene_region};
use serde_json::{Map, Value, json};
use std::f64::consts::TAU;
use std::path::Path;

/// Steepest orbit above or below the equator [rad]: straight from the pole there is no upward direction.
const STEEPEST: f64 = 1.4;

/// Views from one keyframe to the next, where nobody says how many there are.
const BETWEEN_KEYFRAMES: usize = 24;

/// The cameras that the options ask for, in the coordinates of the run, and the frames per second that their file states.
pub fn chosen(args: &RenderArgs, run: &Loaded) -> Result<(Vec<NamedCamera>, Option<f64>), Failure> {
    let mut fps = None;
    let local = |cameras: Vec<NamedCamera>| -> Vec<NamedCamera> {
        cameras.into_iter().map(|c| run.plan.origin.to_local(c)).collect()
    };
    let mut cameras = if let Some(file) = &args.cameras {
        local(read(file)?)
    } else if let Some(file) = &args.camera_path {
        let path = camera_path::read(file, args.path_transform.as_deref())?;
        fps = path.fps;
        local(path.cameras)
    } else if let Some(file) = &args.keyframes {
        let keys = local(read(file)?);
        let usual = BETWEEN_KEYFRAMES * (keys.len().max(2) - 1) + 1;
        camera_path::through(&keys, args.frames.map_or(usual, |n| n as usize))
    } else if let Some(count) = args.spiral {
        spiral(run, count as usize)?
    } else if args.orbit.is_some() || args.paths.is_some() {
        orbit(run, args.orbit.unwrap_or(1) as usize)?
    } else {
        Vec::new()
    };
    if let Some(size) = args.size {
        cameras.iter_mut().for_each(|c| c.camera = camera_path::fitted(&c.camera, size));
    }
    Ok((cameras, fps))
}

/// The cameras of a dataset or of a transforms.json, in the user's world; their pictures may be missing.
pub fn read(path: &Path) -> Result<Vec<NamedCamera>, Failure> {
    // Only poses and sizes are read, so a file that names pictures elsewhere does no harm.
    let options = OpenOptions { allow_outside: true, ..OpenOptions::default() };
    open_cameras(path, &options).map_err(data_failure)
}

/// `count` cameras on a circle around the middle of the run's box: at the median distance and elevation of the training
/// cameras, with the intrinsics of a typical one, without its distortion.
pub fn orbit(run: &Loaded, count: usize) -> Result<Vec<NamedCamera>, Failure> {
    let data = reopen(run)?;
    let cameras: Vec<&Camera> = data.split.train.iter().map(|&i| &data.views[i].camera).collect();
    Ok(around(&cameras, run.plan.finest.bounds.cast::<f64>().center(), scene_region(&data).up, count))
}

/// Turns of a spiral around a scene.
const TURNS: f64 = 2.0;
/// A spiral reaches so far between the lowest and the highest photographs, or to the sides of the middle one.
const REACH: f64 = 0.8;
/// Photographs surround the scene if the mean of their directions is shorter than this.
const SURROUNDING: f64 = 0.5;

/// `count` cameras on a spiral. Around the scene, if the photographs surround it: [`TURNS`] turns from the lowest to the highest
/// of them. Otherwise before it, around the middle of the photographs, to both sides, upwards and downwards as they are.
pub fn spiral(run: &Loaded, count: usize) -> Result<Vec<NamedCamera>, Failure> {
    let data = reopen(run)?;
    let cameras: Vec<&Camera> = data.split.train.iter().map(|&i| &data.views[i].camera).collect();
    let (middle, up) = (run.plan.finest.bounds.cast::<f64>().center(), scene_region(&data).up);
    Ok(spiral_around(&cameras, middle, up, count))
}

fn spiral_around(cameras: &[&Camera], middle: Vec3<f64>, up: Vec3<f64>, count: usize) -> Vec<NamedCamera> {
    let from_middle = |c: &&Camera| c.world_from_camera.translation - middle;
    let mean = |of: &dyn Fn(&&Camera) -> Vec3<f64>| {
        cameras.iter().map(of).fold(Vec3::zero(), |a, b| a + b) * (1.0 / cameras.len().max(1) as f64)
    };
    let circle = around(cameras, middle, up, 1);
    let Some(NamedCamera { camera: typical, .. }) = circle.first() else { return Vec::new() };
    let angle = 2.0 * (0.5 * f64::from(typical.width) / typical.focal[0]).atan();
    let look = |k: usize, eye: Vec3<f64>| {
        let camera = Camera::look_at(eye, middle, up, angle, [typical.width, typical.height]);
        NamedCamera { name: format!("{k:04}"), camera }
    };
    let share = |k: usize| k as f64 / count.max(1) as f64;
    let spread = |axis: Vec3<f64>, from: Vec3<f64>| {
        REACH
            * cameras
                .iter()
                .map(|c| (c.world_from_camera.translation - from).dot(axis).abs())
                .fold(0.0, f64::max)
    };
    let sideways = |c: &&Camera| {
        let d = from_middle(c).normalized();
        let level = d - up * d.dot(up);
        if level.length() > 0.0 { level.normalized() } else { level }
    };
    if mean(&sideways).length() < SURROUNDING {
        let elevation = |c: &&Camera| from_middle(c).normalized().dot(up).clamp(-1.0, 1.0).asin();
        let all = || cameras.iter().map(elevation);
        let [low, high] = [all().fold(STEEPEST, f64::min), all().fold(-STEEPEST, f64::max)];
        let start = circle[0].camera.world_from_camera.translation - middle;
        let level = (start - up * start.dot(up)).normalized();
        let across = up.cross(level);
        return (0..count)
            .map(|k| {
                let (azimuth, t) = (TAU * TURNS * share(k), 0.5 - 0.5 * (TAU * share(k)).cos());
                let elevation = 0.5 * (low + high) + REACH * (t - 0.5) * (high - low);
                let level = level * azimuth.cos() + across * azimuth.sin();
                let elevation = elevation.clamp(-STEEPEST, STEEPEST);
                look(k, middle + (level * elevation.cos() + up * elevation.sin()) * start.length())
            })
            .collect();
    }
    let eye = mean(&|c| c.world_from_camera.translation);
    let forward = (middle - eye).normalized();
    let right = forward.cross(up).normalized();
    let above = right.cross(forward);
    let [wide, tall] = [spread(right, eye), spread(above, eye)];
    (0..count)
        .map(|k| {
            let (sine, cosine) = (TAU * TURNS * share(k)).sin_cos();
            look(k, eye + right * (wide * cosine) + above * (tall * sine * (0.5 * TAU * share(k)).sin()))
        })
        .collect()
}

fn around(cameras: &[&Camera], middle: Vec3<f64>, up: Vec3<f64>, count: usize) -> Vec<NamedCamera> {
    let from_middle = |c: &&Camera| c.world_from_camera.translation - middle;
    let distance = median(cameras.iter().map(|c| from_middle(c).length()));
    let elevation =
        median(cameras.iter().map(|c| (from_middle(c).normalized().dot(up)).clamp(-1.0, 1.0).asin()));
    let elevation = elevation.clamp(-STEEPEST, STEEPEST);
    let focal = median(cameras.iter().map(|c| c.focal[0]));
    let off = |c: &&&Camera| (c.focal[0] - focal).abs();
    let typical = cameras.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
    let size = typical.map_or([200, 200], |c| [c.width, c.height]);
    let angle = typical.map_or(0.7, |c| 2.0 * (0.5 * f64::from(c.width) / c.focal[0]).atan());
    let axis = if up.x.abs() < 0.9 { Vec3::new(1.0, 0.0, 0.0) } else { Vec3::new(0.0, 1.0, 0.0) };
    let east = (axis - up * axis.dot(up)).normalized();
    let north = up.cross(east);
    (0..count)
        .map(|k| {
            let azimuth = TAU * k as f64 / count as f64;
            let level = east * azimuth.cos() + north * azimuth.sin();
            let eye = middle + (level * elevation.cos() + up * elevation.sin()) * distance;
            NamedCamera { name: format!("{k:04}"), camera: Camera::look_at(eye, middle, up, angle, size) }
        })
        .collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    quantile(values, 0.5).unwrap_or(0.0)
}

/// The cameras as a transforms.json of nerfstudio, which `--cameras` reads again, with `notes` as further keys.
pub fn export(cameras: &[NamedCamera], notes: Vec<(&'static str, Value)>) -> Value {
    let frame = |c: &NamedCamera| {
        let mut frame = intrinsics(&c.camera);
        frame.insert("file_path".into(), json!(format!("{}.png", c.name)));
        frame.insert("transform_matrix".into(), json!(opengl_matrix(&c.camera)));
        frame
    };
    let mut document = Map::new();
    document.extend(notes.into_iter().map(|(key, note)| (key.to_owned(), note)));
    document.insert("frames".into(), cameras.iter().map(frame).collect());
    Value::Object(document)
}

/// The keys of a camera in a transforms.json.
pub fn intrinsics(c: &Camera) -> Map<String, Value> {
    let mut keys = Map::new();
    let mut put = |key: &str, value: Value| drop(keys.insert(key.to_owned(), value));
    put("w", json!(c.width));
    put("h", json!(c.height));
    for (k, (focal, center)) in [("fl_x", "cx"), ("fl_y", "cy")].into_iter().enumerate() {
        put(focal, json!(c.focal[k]));
        put(center, json!(c.center[k]));
    }
    let (model, k, p): (_, &[f64], &[f64]) = match &c.lens {
        Lens::Pinhole => ("PINHOLE", &[], &[]),
        Lens::OpenCv { k, p } => ("OPENCV", k, p),
        Lens::FullOpenCv { k, p } => ("FULL_OPENCV", k, p),
        Lens::Fisheye { k } => ("OPENCV_FISHEYE", k, &[]),
        Lens::Equirectangular => ("EQUIRECTANGULAR", &[], &[]),
        Lens::Fov { omega } => ("FOV", std::slice::from_ref(omega), &[]),
        Lens::ThinPrismFisheye { k, p, .. } => ("THIN_PRISM_FISHEYE", k, p),
    };
    put("camera_model", json!(model));
    k.iter().enumerate().for_each(|(i, v)| put(&format!("k{}", i + 1), json!(v)));
    p.iter().enumerate().for_each(|(i, v)| put(&format!("p{}", i + 1), json!(v)));
    keys
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    fn capture() -> Vec<Camera> {
        let eye = |a: f64| vec3(1.0 + 2.0 * a.cos(), 2.0 * a.sin(), 1.5);
        let middle = vec3(1.0, 0.0, 0.0);
        (0..8)
            .map(|i| Camera::look_at(eye(f64::from(i)), middle, vec3(0.0, 0.0, 1.0), 0.6, [40, 30]))
            .collect()
    }

    #[test]
    fn orbit_stands_where_the_capture_stood() {
        let cameras = capture();
        let all: Vec<&Camera> = cameras.iter().collect();
        let (middle, up) = (vec3(1.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0));
        let orbit = around(&all, middle, up, 12);
        assert_eq!((orbit.len(), orbit[11].name.as_str()), (12, "0011"));
        for NamedCamera { camera, .. } in &orbit {
            let eye = camera.world_from_camera.translation;
            assert!(((eye - middle).length() - 2.5).abs() < 1e-9 && (eye.z - 1.5).abs() < 1e-9);
            let [u, v] = camera.project(middle).unwrap();
            assert!((u - 20.0).abs() < 1e-9 && (v - 15.0).abs() < 1e-9);
            assert!((camera.focal[0] - cameras[0].focal[0]).abs() < 1e-9);
        }
    }

    #[test]
    fn exported_cameras_are_read_back() {
        let mut cameras: Vec<NamedCamera> = capture()
            .into_iter()
            .enumerate()
            .map(|(i, camera)| NamedCamera { name: format!("{i:04}"), camera })
            .collect();
        cameras[1].camera.lens = Lens::OpenCv { k: [0.1, -0.02, 0.0, 0.0], p: [0.001, 0.0] };
        cameras[2].camera.lens = Lens::Fisheye { k: [0.1, 0.0, 0.0, 0.0] };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("transforms.json");
        std::fs::write(&path, export(&cameras, Vec::new()).to_string()).unwrap();
        let back = read(&path).unwrap();
        for (a, b) in cameras.iter().zip(&back) {
            assert_eq!((&a.name, a.camera.lens, a.camera.focal), (&b.name, b.camera.lens, b.camera.focal));
            let moved = a.camera.world_from_camera.translation - b.camera.world_from_camera.translation;
            assert!(moved.length() < 1e-12);
        }
    }
}
