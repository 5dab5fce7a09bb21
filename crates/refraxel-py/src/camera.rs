//! Cameras: poses, lenses and rays.

use crate::arrays::{Array, of_vectors, shaped, values, vector};
use crate::errors::refused;
use crate::interruptible::for_each;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use refraxel_core::{Lens, Mat3, Pose, Vec3, vec3};
use refraxel_data::limits::IMAGE_PIXELS;

/// A posed camera with its lens.
///
/// Its frame has x right, y down and z forward; pixel (i, j) has its centre at (i + 0.5, j + 0.5), row 0 on top.
#[pyclass(frozen, eq, module = "refraxel", from_py_object)]
#[derive(Clone, Copy, PartialEq)]
pub struct Camera(pub refraxel_core::Camera);

/// A lens from its name and coefficients.
fn lens(name: &str, c: &[f64]) -> PyResult<Lens> {
    let wrong =
        |expected: &str| refused(format!("lens {name:?} with {} coefficients; expected {expected}", c.len()));
    match (name, c) {
        ("pinhole", []) => Ok(Lens::Pinhole),
        ("opencv", &[k1, k2, p1, p2]) => Ok(Lens::OpenCv { k: [k1, k2, 0.0, 0.0], p: [p1, p2] }),
        ("opencv", &[k1, k2, p1, p2, k3]) => Ok(Lens::OpenCv { k: [k1, k2, k3, 0.0], p: [p1, p2] }),
        ("fisheye", &[k1, k2, k3, k4]) => Ok(Lens::Fisheye { k: [k1, k2, k3, k4] }),
        ("panorama", []) => Ok(Lens::Equirectangular),
        ("pinhole" | "panorama", _) => Err(wrong("none")),
        ("opencv", _) => Err(wrong("k1, k2, p1, p2 and maybe k3, as OpenCV orders them")),
        ("fisheye", _) => Err(wrong("k1, k2, k3, k4")),
        _ => Err(wrong("one of pinhole, opencv, fisheye, panorama")),
    }
}

/// A pose from a 4 × 4 or 3 × 4 matrix.
fn pose(array: &Array<'_, f64>) -> PyResult<Pose> {
    let m = &values(array);
    let is_motion = match array.shape() {
        [3, 4] => true,
        [4, 4] => m[12..] == [0.0, 0.0, 0.0, 1.0],
        _ => false,
    };
    if !is_motion || !m.iter().all(|v| v.is_finite()) {
        return Err(refused(
            "world_from_camera is no rigid motion; expected a 4 × 4 matrix (or its first three rows) with the rotation, the \
             position in the last column, and (0, 0, 0, 1) below",
        ));
    }
    let columns = [0, 1, 2].map(|c| vec3(m[c], m[4 + c], m[8 + c]));
    let off = (0..3)
        .flat_map(|a| (0..3).map(move |b| (a, b)))
        .map(|(a, b)| (columns[a].dot(columns[b]) - if a == b { 1.0 } else { 0.0 }).abs());
    if off.fold(0.0, f64::max) > 1e-3 || columns[0].cross(columns[1]).dot(columns[2]) < 0.0 {
        return Err(refused(
            "world_from_camera: its rotation is not orthonormal and right-handed within 1e-3; expected x right, y down, \
             z forward, without scale",
        ));
    }
    Ok(Pose { rotation: Mat3 { columns }, translation: vec3(m[3], m[7], m[11]) })
}

/// A size that an image can have.
fn size([width, height]: [i64; 2]) -> PyResult<[u32; 2]> {
    let pixels =
        u64::try_from(width).ok().zip(u64::try_from(height).ok()).and_then(|(w, h)| w.checked_mul(h));
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) if pixels.is_some_and(|n| (1..=IMAGE_PIXELS).contains(&n)) => Ok([w, h]),
        _ => Err(refused(format!(
            "an image of {width} × {height} pixels; expected at least one, and at most {IMAGE_PIXELS}"
        ))),
    }
}

/// What `f` gives for each pixel, row by row.
fn of_pixels<T: Send>(
    py: Python<'_>,
    camera: &refraxel_core::Camera,
    f: impl Fn(u32, u32) -> T + Send + Sync,
) -> PyResult<Vec<T>> {
    let rows: Vec<u32> = (0..camera.height).collect();
    let row = |&y: &u32| (0..camera.width).map(|x| f(x, y)).collect::<Vec<T>>();
    Ok(for_each(py, &rows, row)?.into_iter().flatten().collect())
}

#[pymethods]
impl Camera {
    /// A camera of `width` × `height` pixels.
    ///
    /// focal: focal lengths (fx, fy) [pixel]. world_from_camera: (4, 4) or (3, 4), the rotation and, in the last column, the position
    /// [scene unit]. center: principal point [pixel], the middle of the image if absent. distortion: coefficients of the lens in the order
    /// of OpenCV: (k1, k2, p1, p2[, k3]) for "opencv", (k1, k2, k3, k4) for "fisheye".
    #[new]
    #[pyo3(signature = (width, height, focal, world_from_camera, *, center = None, lens = "pinhole", distortion = Vec::new()))]
    fn new(
        width: i64,
        height: i64,
        focal: [f64; 2],
        world_from_camera: Array<'_, f64>,
        center: Option<[f64; 2]>,
        lens: &str,
        distortion: Vec<f64>,
    ) -> PyResult<Self> {
        let [width, height] = size([width, height])?;
        if !focal.iter().all(|f| f.is_finite() && *f > 0.0) {
            return Err(refused(format!("focal is {focal:?}; expected positive numbers of pixels")));
        }
        let center = center.unwrap_or([0.5 * f64::from(width), 0.5 * f64::from(height)]);
        for (name, given) in [("center", &center[..]), ("distortion", &distortion)] {
            if !given.iter().all(|v| v.is_finite()) {
                return Err(refused(format!("{name} is {given:?}; expected finite numbers")));
            }
        }
        let (lens, world_from_camera) = (self::lens(lens, &distortion)?, pose(&world_from_camera)?);
        Ok(Self(refraxel_core::Camera { width, height, focal, center, lens, world_from_camera }))
    }

    /// A pinhole camera at `eye` that looks at `target`, both (3,) [scene unit].
    ///
    /// fov_x: full horizontal field of view [rad]. size: (width, height) [pixel].
    #[staticmethod]
    #[pyo3(signature = (eye, target, *, up = None, fov_x = 0.7, size = [200, 200]))]
    fn look_at(
        eye: Array<'_, f64>,
        target: Array<'_, f64>,
        up: Option<Array<'_, f64>>,
        fov_x: f64,
        size: [i64; 2],
    ) -> PyResult<Self> {
        let (eye, target) = (vector("eye", &eye)?, vector("target", &target)?);
        let up = up.map_or(Ok(vec3(0.0, 0.0, 1.0)), |up| vector("up", &up))?;
        let size = self::size(size)?;
        let sine = (target - eye).cross(up).length();
        if !(sine > 0.0 && sine.is_finite() && fov_x > 0.0 && fov_x < 3.1) {
            return Err(refused(
                "look_at needs a target away from the eye, not straight up or down, and fov_x between 0 and 3.1 rad",
            ));
        }
        Ok(Self(refraxel_core::Camera::look_at(eye, target, up, fov_x, size)))
    }

    /// Image width [pixel].
    #[getter]
    fn width(&self) -> u32 {
        self.0.width
    }

    /// Image height [pixel].
    #[getter]
    fn height(&self) -> u32 {
        self.0.height
    }

    /// Focal lengths (fx, fy) [pixel].
    #[getter]
    fn focal(&self) -> (f64, f64) {
        self.0.focal.into()
    }

    /// Principal point (cx, cy) [pixel].
    #[getter]
    fn center(&self) -> (f64, f64) {
        self.0.center.into()
    }

    /// The pose, (4, 4) float64: maps points of the camera frame to the world [scene unit].
    #[getter]
    fn world_from_camera(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let Pose { rotation, translation } = &self.0.world_from_camera;
        let row = |a: usize| {
            [rotation.columns[0][a], rotation.columns[1][a], rotation.columns[2][a], translation[a]]
        };
        shaped(py, [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]].concat(), &[4, 4])
    }

    /// The same camera with another pose, (4, 4) or (3, 4).
    fn moved(&self, world_from_camera: Array<'_, f64>) -> PyResult<Self> {
        let world_from_camera = pose(&world_from_camera)?;
        Ok(Self(refraxel_core::Camera { world_from_camera, ..self.0 }))
    }

    /// The same camera for an image of another size [pixel].
    fn resized(&self, width: i64, height: i64) -> PyResult<Self> {
        let [width, height] = size([width, height])?;
        Ok(Self(self.0.resized(width, height)))
    }

    /// Unit directions through the pixel centres in the camera frame, (height, width, 3); NaN where the lens is blind.
    fn directions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let (camera, blind) = (&self.0, Vec3::splat(f64::NAN));
        let direction = |x: u32, y: u32| {
            camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5).map_or(blind, Vec3::normalized)
        };
        of_vectors(py, of_pixels(py, camera, direction)?, &[camera.height as usize, camera.width as usize])
    }

    /// Origins [scene unit] and unit directions through the pixel centres in the world, each (height, width, 3).
    fn rays(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, Py<PyAny>)> {
        let (camera, blind) = (&self.0, Vec3::splat(f64::NAN));
        let shape = [camera.height as usize, camera.width as usize];
        let direction = |x: u32, y: u32| {
            let ray = camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5);
            ray.map_or(blind, |ray| ray.direction)
        };
        let origins = vec![camera.world_from_camera.translation; shape[0] * shape[1]];
        Ok((of_vectors(py, origins, &shape)?, of_vectors(py, of_pixels(py, camera, direction)?, &shape)?))
    }

    /// Pixel coordinates (u, v) of a world point (3,), or None where the camera does not see it.
    fn project(&self, point: Array<'_, f64>) -> PyResult<Option<(f64, f64)>> {
        Ok(self.0.project(vector("point", &point)?).map(Into::into))
    }

    fn __repr__(&self) -> String {
        let eye = self.0.world_from_camera.translation.to_array();
        format!("Camera({} × {}, at {eye:?})", self.0.width, self.0.height)
    }
}
