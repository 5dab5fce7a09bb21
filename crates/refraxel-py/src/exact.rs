//! The exact tracer and its scenes.

use crate::arrays::{Array, Rays, of_vectors, shaped, vectors};
use crate::camera::Camera;
use crate::dataset::Dataset;
use crate::errors::{cancelled, input, of_data, refused};
use crate::interruptible::{for_each, interruptible, with_events};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use refraxel_data::limits::FRAMES;
use refraxel_data::synth::{
    CameraSet, DatasetOptions, Frame, IndexTruth, Limits, Reflection, Sampling, SceneOptions, SynthError,
    SynthOptions, Tracer, ViewCounts, render_view_while, scene, scene_list, synthesize,
};
use refraxel_data::{Backdrop, MaskMeaning, Part, Photo, PosedPhoto, Split};
use refraxel_train::cancel::Cancel;
use std::ops::ControlFlow;
use std::path::PathBuf;

/// A scene of the exact tracer: closed-form surfaces, Snell and Fresnel, graded media with error control, double precision.
#[pyclass(frozen, module = "refraxel")]
pub struct Scene(refraxel_data::synth::Scene);

/// All scenes: (name, what it shows, usual index or None).
#[pyfunction]
pub fn scenes() -> Vec<(&'static str, &'static str, Option<f64>)> {
    scene_list().iter().map(|s| (s.name, s.shows, s.ior.map(|r| r.default))).collect()
}

fn failure(error: SynthError) -> PyErr {
    match error {
        SynthError::Stopped { .. } => cancelled(),
        _ => input(error),
    }
}

/// Samples per pixel, as `synth` takes them.
fn checked_spp(spp: u32) -> PyResult<u32> {
    let is_usual = (1..=65_536).contains(&spp);
    is_usual.then_some(spp).ok_or_else(|| refused(format!("spp is {spp}; expected 1 to 65536")))
}

fn reflection(is_on: bool) -> Reflection {
    if is_on { Reflection::On } else { Reflection::Off }
}

/// Renders a dataset of a scene into a folder, with ground truth: `views` training views, a tenth for validation, two fifths for testing.
///
/// size [pixel]. ior: index of the main body. spp: samples per pixel. Ctrl-C keeps the finished pictures; the same call goes on.
#[pyfunction]
#[pyo3(signature = (scene, out, *, size = 200, views = 100, seed = 0, ior = None, spp = 16, reflection = true))]
#[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn synth(
    py: Python<'_>,
    scene: &str,
    out: PathBuf,
    size: u32,
    views: usize,
    seed: u64,
    ior: Option<f64>,
    spp: u32,
    reflection: bool,
) -> PyResult<()> {
    let views = ViewCounts { train: views, val: views.div_ceil(10), test: (2 * views).div_ceil(5) };
    let reflection = self::reflection(reflection);
    let options = SynthOptions { size, views, seed, ior, spp, reflection, ..SynthOptions::new(scene, out) };
    let cancel = Cancel::new();
    let made = with_events(py, &cancel, None, |_| {
        let goes_on =
            |_| if cancel.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        synthesize(&options, &goes_on)
    })?;
    made.map(|_| ()).map_err(failure)
}

#[pymethods]
impl Scene {
    /// A scene by its name, see refraxel.scenes(). seed: textures. ior: index of the main body.
    #[new]
    #[pyo3(signature = (name, *, seed = 0, ior = None))]
    fn new(name: &str, seed: u64, ior: Option<f64>) -> PyResult<Self> {
        scene(name, &SceneOptions { seed, ior, mesh: None }).map(Self).map_err(failure)
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Its box, lower and upper corner, (2, 3) [scene unit].
    #[getter]
    fn bounds(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let bounds = &self.0.bounds;
        shaped(py, bounds.to_arrays().concat(), &[2, 3])
    }

    /// The index of refraction at points (..., 3) [scene unit].
    fn index(&self, py: Python<'_>, points: Array<'_, f64>) -> PyResult<Py<PyAny>> {
        let (points, shape) = vectors("points", &points)?;
        let truth = IndexTruth::of_scene(&self.0);
        let found = for_each(py, &points, |&x| truth.as_ref().map_or(1.0, |truth| truth.n(x)))?;
        shaped(py, found, &shape)
    }

    /// Linear basic radiance L/n² that arrives against rays, (..., 3).
    #[pyo3(signature = (origins, directions, *, reflection = true))]
    fn radiance(
        &self,
        py: Python<'_>,
        origins: Array<'_, f64>,
        directions: Array<'_, f64>,
        reflection: bool,
    ) -> PyResult<Py<PyAny>> {
        let rays = Rays::new(&origins, &directions)?;
        let limits = Limits { reflection: self::reflection(reflection), ..Limits::default() };
        let tracer = Tracer { scene: &self.0, limits };
        let found = for_each(py, &rays.rays, |&ray| tracer.radiance(ray).0)?;
        shaped(py, found.into_flattened(), &[&rays.shape[..], &[3]].concat())
    }

    /// For each ray the path that is always transmitted: positions (n, 3) [scene unit] and unit directions (n, 3).
    fn paths(
        &self,
        py: Python<'_>,
        origins: Array<'_, f64>,
        directions: Array<'_, f64>,
    ) -> PyResult<Vec<(Py<PyAny>, Py<PyAny>)>> {
        let rays = Rays::new(&origins, &directions)?;
        let tracer = Tracer { scene: &self.0, limits: Limits::default() };
        let found = for_each(py, &rays.rays, |&ray| tracer.main_path(ray))?;
        let entry = |path: Vec<refraxel_core::Ray<f64>>| {
            let points = of_vectors(py, path.iter().map(|r| r.origin), &[path.len()])?;
            Ok((points, of_vectors(py, path.iter().map(|r| r.direction), &[path.len()])?))
        };
        found.into_iter().map(entry).collect()
    }

    /// A view: `image` and `mask` (uint8), `linear` radiance, `depth` along the axis [scene unit] and `normal`.
    #[pyo3(signature = (camera, *, spp = 16, seed = 0, reflection = true))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        camera: Camera,
        spp: u32,
        seed: u64,
        reflection: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let limits = Limits { reflection: self::reflection(reflection), ..Limits::default() };
        let sampling = Sampling { spp: checked_spp(spp)?, detail_spp: 0, seed, limits };
        let frame = self.view(py, &camera.0, 0, &sampling)?;
        let [w, h] = frame.size.map(|n| n as usize);
        let all = PyDict::new(py);
        let refraxel_data::Pixels::U8(pixels) = frame.image().pixels else {
            unreachable!("a frame has 8 bits")
        };
        all.set_item("image", shaped(py, pixels, &[h, w, 3])?)?;
        all.set_item("mask", shaped(py, frame.mask().coverage, &[h, w])?)?;
        all.set_item("linear", shaped(py, frame.color.into_flattened(), &[h, w, 3])?)?;
        all.set_item("depth", shaped(py, frame.depth, &[h, w])?)?;
        all.set_item("normal", of_vectors(py, frame.normal, &[h, w])?)?;
        Ok(all)
    }

    /// A dataset in memory: views = (train, val, test), with masks of what is refractive. size = (width, height) [pixel].
    #[pyo3(signature = (*, size = [200, 200], views = [100, 10, 40], seed = 0, spp = 16, reflection = true))]
    fn dataset(
        &self,
        py: Python<'_>,
        size: [u32; 2],
        views: [usize; 3],
        seed: u64,
        spp: u32,
        reflection: bool,
    ) -> PyResult<Dataset> {
        if !size.iter().all(|n| (1..=8192).contains(n)) {
            return Err(refused(format!(
                "size is {size:?}; expected (width, height) of 1 to 8192 pixels each"
            )));
        }
        let total = views.iter().try_fold(0usize, |sum, n| sum.checked_add(*n));
        if !total.is_some_and(|n| (1..=FRAMES).contains(&n)) {
            return Err(refused(format!("views is {views:?}; expected 1 to {FRAMES} in all")));
        }
        let views = ViewCounts { train: views[0], val: views[1], test: views[2] };
        let limits = Limits { reflection: self::reflection(reflection), ..Limits::default() };
        let sampling = Sampling { spp: checked_spp(spp)?, detail_spp: 0, seed, limits };
        let options = DatasetOptions { size, views, cameras: CameraSet::Upper, sampling };
        let (photos, split) = self.photos(py, &options)?;
        let colour = |c: [u8; 3]| Backdrop::Color(c.map(|v| f32::from(v) / 255.0));
        let behind = self.0.background().map_or(Backdrop::Surroundings, colour);
        refraxel_data::Dataset::in_memory(photos, split, behind).map(Dataset::in_memory).map_err(of_data)
    }
}

impl Scene {
    /// A view, unless a signal stops it between two pixels.
    fn view(
        &self,
        py: Python<'_>,
        camera: &refraxel_core::Camera,
        number: u64,
        sampling: &Sampling,
    ) -> PyResult<Frame> {
        interruptible(py, |cancel| {
            let goes_on = || !cancel.is_cancelled();
            render_view_while(&self.0, camera, number, sampling, &goes_on).ok_or_else(cancelled)
        })
    }

    /// The views of a dataset, one after the other, with a look at signals between them.
    fn photos(&self, py: Python<'_>, options: &DatasetOptions) -> PyResult<(Vec<PosedPhoto>, Split)> {
        let (mut photos, mut split) = (Vec::new(), Split::default());
        for part in Part::ALL {
            for (index, camera) in options.split_cameras(&self.0, part).into_iter().enumerate() {
                let number = (part as u64) << 32 | index as u64;
                let frame = self.view(py, &camera, number, &options.sampling)?;
                match part {
                    Part::Train => split.train.push(photos.len()),
                    Part::Val => split.val.push(photos.len()),
                    Part::Test => split.test.push(photos.len()),
                }
                photos.push(PosedPhoto {
                    name: format!("r_{index}.png"),
                    camera,
                    photo: Photo::new(frame.image(), Some(frame.mask())),
                    mask_meaning: MaskMeaning::Refractive,
                });
            }
        }
        Ok((photos, split))
    }
}
