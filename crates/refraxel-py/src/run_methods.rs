//! What Python can do with a run: save, render, score and export it, and go on with it in a session.

use crate::arrays::{of_vectors, shaped};
use crate::camera::Camera;
use crate::dataset::Dataset;
use crate::errors::{cancelled, raised, refused};
use crate::evaluation::{part, scores};
use crate::interruptible::with_events;
use crate::json;
use crate::medium::Medium;
use crate::model::Model;
use crate::rendering::Rendering;
use crate::run::Run;
use crate::session::Session;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use refraxel::exit::Failure;
use refraxel::verbs::export;
use refraxel::verbs::files::create_folder;
use refraxel::verbs::loaded::Loaded;
use refraxel::verbs::reopen::reopen;
use refraxel_data::View;
use refraxel_train::Backend;
use refraxel_train::cancel::Cancel;
use refraxel_train::evaluation::{self, EvaluateError};
use refraxel_train::events::Observer;
use refraxel_train::metrics::ImageScore;
use refraxel_train::model::surface::Surface;
use refraxel_train::run::Run as Stored;
use std::path::PathBuf;

#[pymethods]
impl Run {
    /// Reads the run of a folder.
    #[staticmethod]
    fn load(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let run = py.detach(|| Stored::load(&folder).map(Self::new).map_err(Failure::from));
        run.map_err(raised)
    }

    /// Saves the run in a folder, atomically.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        py.detach(|| {
            create_folder(&folder)?;
            self.stored().view().save(&folder).map_err(Failure::from)
        })
        .map_err(raised)
    }

    /// What a camera sees, as `refraxel render` draws it: with several rays per pixel where paths turn.
    fn render(&self, py: Python<'_>, camera: Camera) -> PyResult<Rendering> {
        let (cancel, marching) = (Cancel::new(), self.marching());
        let (backend, camera) = (&self.loaded.backend, self.loaded.plan.origin.to_local(camera.0));
        let seen =
            with_events(py, &cancel, None, |_| evaluation::render(backend, &camera, &marching, &cancel))?;
        Rendering::new(py, seen.map_err(|_| cancelled())?)
    }

    /// Renders and scores a part of the data: PSNR [dB] and SSIM, in all and per image, with the name of the protocol.
    ///
    /// data: what the run is scored on; None opens the dataset of the training again.
    #[pyo3(signature = (data = None, part = "test", *, on_event = None))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        data: Option<&Dataset>,
        part: &str,
        on_event: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (part, cancel, marching, run) = (self::part(part)?, Cancel::new(), self.marching(), &self.loaded);
        let data = match data {
            Some(given) => given.data.clone().with_origin(run.plan.origin),
            None => py.detach(|| reopen(run)).map_err(raised)?,
        };
        let found = with_events(py, &cancel, on_event, |observer| {
            let mut watch = Observer::new(&cancel, observer);
            let mut each = |_: &View, _: &_, _: &ImageScore| Ok::<(), EvaluateError>(());
            evaluation::evaluate(run.learned(&marching), &data, part, &mut watch, &mut each)
        })?;
        scores(py, &found.map_err(|e| raised(e.into()))?)
    }

    /// Writes everything solid as closed meshes, opaque things with their colours, in world coordinates: to a name that ends in .ply or
    /// .obj; with cameras, and at most `points` points of opaque things besides, where the run's dataset can be opened, to one in .glb.
    /// detail: cells per voxel.
    #[pyo3(signature = (path, *, detail = 1, points = 0))]
    fn export(&self, py: Python<'_>, path: PathBuf, detail: u32, points: usize) -> PyResult<()> {
        if detail == 0 {
            return Err(refused("detail is 0; expected cells per voxel, from 1 on"));
        }
        let run = &self.loaded;
        let written = match path.extension().and_then(|e| e.to_str()) {
            Some("ply") => py.detach(|| export::write_ply(run, "the run", detail, &path)),
            Some("obj") => py.detach(|| export::write_obj(run, "the run", detail, &path)),
            Some("glb") => py.detach(|| export::write_gltf(run, "the run", detail, points, &path)),
            _ => {
                let found = path.display();
                return Err(refused(format!("{found}: expected a name that ends in .ply, .obj or .glb")));
            }
        };
        written.map(|_| ()).map_err(raised)
    }

    /// The refractive surfaces: dictionaries with `vertices` and `normals` (n, 3) [scene unit], `triangles` (m, 3) uint32, `index` and
    /// `absorption` (3) of linear red, green and blue [1 / scene unit].
    #[pyo3(signature = (*, detail = 1))]
    fn surfaces<'py>(&self, py: Python<'py>, detail: u32) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let regions = self.loaded.backend.medium().medium.regions();
        if detail == 0 || !regions.iter().all(|r| Surface::fits(r, detail)) {
            return Err(refused(format!(
                "detail is {detail}; expected 1 or a little more, so that the mesh fits into memory"
            )));
        }
        let found = py.detach(|| regions.iter().map(|r| Surface::of(r, detail)).collect::<Vec<_>>());
        let origin = self.loaded.plan.origin;
        let entry = |surface: Surface| {
            let (entry, mesh) = (PyDict::new(py), surface.mesh);
            let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
            let places: Vec<_> = mesh.vertices.into_iter().map(|x| origin.to_world(x)).collect();
            entry.set_item("vertices", of_vectors(py, places, &[vertices])?)?;
            entry.set_item("normals", of_vectors(py, mesh.normals, &[vertices])?)?;
            entry.set_item("triangles", shaped(py, mesh.triangles.into_flattened(), &[triangles, 3])?)?;
            entry.set_item("index", surface.index)?;
            entry.set_item("absorption", surface.absorption)?;
            Ok(entry)
        };
        found.into_iter().flatten().map(entry).collect()
    }

    /// The parameters of the run as a differentiable Model, a copy. Rays are marched as the run renders, with its cut-offs. Its
    /// coordinates, and those of its rays, are relative to `origin`.
    fn model(&self, py: Python<'_>) -> Model {
        let marching = self.marching();
        py.detach(|| Model::of(self.loaded.backend.snapshot().model.into_owned(), marching))
    }

    /// What bends the rays of the run, in double precision, a copy. Its coordinates are relative to `origin`.
    fn medium(&self) -> Medium {
        Medium::of(self.loaded.backend.medium().medium.cast())
    }

    /// A session that goes on with this run on the same data. Of its options only those of the section run may change.
    #[pyo3(signature = (data, *, options = None, on_event = None))]
    fn resume(
        &self,
        py: Python<'_>,
        data: &Dataset,
        options: Option<&Bound<'_, PyMapping>>,
        on_event: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Session> {
        Session::resumed(py, self.stored(), data, options, on_event)
    }

    /// The point of the data's coordinates that computation begins at, (3,) [scene unit]: 0, unless the scene is far from there.
    #[getter]
    fn origin(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        shaped(py, self.loaded.plan.origin.place().to_array().to_vec(), &[3])
    }

    /// Steps done.
    #[getter]
    fn step(&self) -> u64 {
        self.loaded.state.step
    }

    /// Mean index of refraction of each region.
    #[getter]
    fn indices(&self) -> Vec<f64> {
        self.loaded.backend.medium().mean_indices()
    }

    /// Where the run stands.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, &self.loaded.state)
    }

    /// Its options, by section and name.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, &self.loaded.options)
    }

    /// Which data it was trained on, and how they were read.
    #[getter]
    fn source<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json::to_python(py, &self.loaded.source)
    }

    fn __repr__(&self) -> String {
        let Loaded { state, source, backend, .. } = &self.loaded;
        format!(
            "Run({}, step {}, grid {:?}, indices {:.3?})",
            source.name(),
            state.step,
            backend.domain().resolution,
            backend.medium().mean_indices()
        )
    }
}
