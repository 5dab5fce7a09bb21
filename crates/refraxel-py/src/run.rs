//! Finished or saved runs.

use crate::arrays::{of_vectors, shaped};
use crate::attended::attended;
use crate::camera::Camera;
use crate::dataset::Dataset;
use crate::errors::{cancelled, raised, refused};
use crate::json;
use crate::medium::Medium;
use crate::model::Model;
use crate::rendering::Rendering;
use crate::session::Session;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use refraxel::exit::Failure;
use refraxel::verbs::loaded::Loaded;
use refraxel::verbs::{create_folder, export, reopen};
use refraxel_data::View;
use refraxel_train::backend::Marching;
use refraxel_train::cancel::Cancel;
use refraxel_train::evaluation::{self, EvaluateError, Evaluation, Part};
use refraxel_train::events::Watch;
use refraxel_train::metrics::ImageScore;
use refraxel_train::model::Optimiser;
use refraxel_train::model::surface::Surface;
use refraxel_train::run::Run as Stored;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::{Backend, CpuBackend};
use serde_json::json;
use std::path::PathBuf;

/// A run at one moment: everything needed to render it or to go on.
#[pyclass(frozen, module = "refraxel")]
pub struct Run {
    loaded: Loaded,
    sought: Option<refraxel_train::model::Gate>,
    /// The cells that training skips, as the run stores them: it goes on by these, and is rendered by the latest ones.
    occupied: Vec<u64>,
}

/// A part of a dataset by its name.
pub fn part(name: &str) -> PyResult<Part> {
    let all = [Part::Train, Part::Val, Part::Test];
    let found = all.into_iter().find(|p| p.name() == name);
    found.ok_or_else(|| {
        refused(format!("there is no part {name:?} of a dataset; expected train, val or test"))
    })
}

/// Scores as a dictionary.
pub fn scores<'py>(py: Python<'py>, found: &Evaluation) -> PyResult<Bound<'py, PyAny>> {
    let mut all = serde_json::to_value(&found.scores).map_err(|e| refused(e.to_string()))?;
    all["truth_crc32"] = json!(found.truth_crc32);
    if let Some(index) = &found.index {
        all["ior"] = json!(index);
    }
    json::to_python(py, &all)
}

impl Run {
    /// A run of a session or of a file.
    pub fn new(run: Stored) -> Self {
        let Stored { options, plan, state, source, model, optimiser, alignment, sought } = run;
        let marching = rendering_marching(&options, plan.near);
        let occupied = optimiser.occupied.clone();
        let mut backend = CpuBackend::resumed(model, optimiser);
        backend.refresh_occupancy(&marching);
        Self { loaded: Loaded { options, plan, state, source, alignment, backend }, sought, occupied }
    }

    fn marching(&self) -> Marching {
        rendering_marching(&self.loaded.options, self.loaded.plan.near)
    }

    fn stored(&self) -> Stored {
        let Loaded { options, plan, state, source, alignment, backend } = &self.loaded;
        let snapshot = backend.snapshot();
        Stored {
            options: options.clone(),
            plan: plan.clone(),
            state: state.clone(),
            source: source.clone(),
            alignment: alignment.clone(),
            model: snapshot.model.into_owned(),
            optimiser: Optimiser { occupied: self.occupied.clone(), ..snapshot.optimiser.into_owned() },
            sought: self.sought.clone(),
        }
    }
}

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
        let backend = &self.loaded.backend;
        let seen =
            attended(py, &cancel, None, |_| evaluation::render(backend, &camera.0, &marching, &cancel))?;
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
        let reopened = if data.is_none() { Some(py.detach(|| reopen(run)).map_err(raised)?) } else { None };
        let data =
            data.map(|d| &d.data).or(reopened.as_ref()).unwrap_or_else(|| unreachable!("given or opened"));
        let found = attended(py, &cancel, on_event, |observer| {
            let mut watch = Watch::new(&cancel, observer);
            let mut each = |_: &View, _: &_, _: &ImageScore| Ok::<(), EvaluateError>(());
            evaluation::evaluate(run.learned(&marching), data, part, &mut watch, &mut each)
        })?;
        scores(py, &found.map_err(|e| raised(e.into()))?)
    }

    /// Writes the refractive surfaces as closed meshes: in world coordinates to a name that ends in .ply; with opaque things as at most
    /// `points` points, and cameras, where the run's dataset can be opened, to one in .glb. detail: cells per voxel.
    #[pyo3(signature = (path, *, detail = 1, points = 200_000))]
    fn export(&self, py: Python<'_>, path: PathBuf, detail: u32, points: usize) -> PyResult<()> {
        if detail == 0 {
            return Err(refused("detail is 0; expected cells per voxel, from 1 on"));
        }
        let run = &self.loaded;
        let written = match path.extension().and_then(|e| e.to_str()) {
            Some("ply") => py.detach(|| export::write_ply(run, "the run", detail, &path)),
            Some("glb") => py.detach(|| export::write_gltf(run, "the run", detail, points, &path)),
            _ => {
                let found = path.display();
                return Err(refused(format!("{found}: expected a name that ends in .ply or .glb")));
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
        let entry = |surface: Surface| {
            let (entry, mesh) = (PyDict::new(py), surface.mesh);
            let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
            entry.set_item("vertices", of_vectors(py, mesh.vertices, &[vertices])?)?;
            entry.set_item("normals", of_vectors(py, mesh.normals, &[vertices])?)?;
            entry.set_item("triangles", shaped(py, mesh.triangles.into_flattened(), &[triangles, 3])?)?;
            entry.set_item("index", surface.index)?;
            entry.set_item("absorption", surface.absorption)?;
            Ok(entry)
        };
        found.into_iter().flatten().map(entry).collect()
    }

    /// The parameters of the run as a differentiable Model, a copy. Rays are marched as the run renders, with its cut-offs.
    fn model(&self, py: Python<'_>) -> Model {
        let marching = self.marching();
        py.detach(|| Model::of(self.loaded.backend.snapshot().model.into_owned(), marching))
    }

    /// What bends the rays of the run, in double precision, a copy.
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
