//! What Python can do with a model: read and change its parameters, render, and take gradients.

use super::class::Model;
use super::fields;
use super::gradients::{Gradients, adjoints};
use super::parameters::{Given, Parameter};
use super::state::PORTION;
use crate::arrays::{Array, Rays, shaped};
use crate::errors::refused;
use crate::interruptible::go_on;
use crate::medium::Medium;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use refraxel_core::Background;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::radiance::Pixel;
use refraxel_train::Backend;
use refraxel_train::backend::{Layers, Marching};

/// Checks a quantity of marching.
fn at_least_0(name: &str, value: f32) -> PyResult<f32> {
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(refused(format!("{name} is {value}; expected a number from 0 on")))
}

#[pymethods]
impl Model {
    /// A model of dense grids that fill a box.
    ///
    /// density: (X, Y, Z), >= 0 [1 / scene unit]. colour: (X, Y, Z, 3), or SH coefficients (X, Y, Z, 3, 1, 4, 9 or 16). bounds: lower and upper corner,
    /// (2, 3) [scene unit]. background: (3,) or (H, 2 H, 3). step: quadrature step [voxel]. No samples are skipped, so that gradients are complete.
    #[staticmethod]
    #[pyo3(signature = (density, colour, bounds, *, background = None, medium = None, step = 0.5))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn from_arrays(
        py: Python<'_>,
        density: Array<'_, f32>,
        colour: Array<'_, f32>,
        bounds: Array<'_, f64>,
        background: Option<Array<'_, f32>>,
        medium: Option<&Medium>,
        step: f32,
    ) -> PyResult<Self> {
        let field = fields::field(py, &density, &colour, crate::arrays::bounds(&bounds)?)?;
        let background = background.map_or(Ok(Background::Constant([1.0; 3])), |b| fields::background(&b))?;
        let mut model = refraxel_train::Model::straight(field, background);
        if let Some(medium) = medium {
            model.refraction = py.detach(|| fields::refraction(medium));
        }
        if !(step > 0.0 && step.is_finite()) {
            return Err(refused(format!("step is {step}; expected a length in voxels above 0")));
        }
        Ok(py.detach(|| Self::of(model, Marching::exhaustive(step))))
    }

    /// How rays are marched; what is absent stays.
    ///
    /// step [voxel]. near: nothing nearer is seen [scene unit]. min_optical_depth per voxel: samples below count as empty and get no gradient.
    /// min_transmittance: a ray ends below it.
    #[pyo3(signature = (*, step = None, near = None, min_optical_depth = None, min_transmittance = None))]
    fn set_marching(
        &self,
        py: Python<'_>,
        step: Option<f32>,
        near: Option<f32>,
        min_optical_depth: Option<f32>,
        min_transmittance: Option<f32>,
    ) -> PyResult<()> {
        py.detach(|| {
            let mut inner = self.write()?;
            let mut new = inner.marching;
            new.step = step.unwrap_or(new.step);
            new.near = at_least_0("near", near.unwrap_or(new.near))?;
            new.min_optical_depth =
                at_least_0("min_optical_depth", min_optical_depth.unwrap_or(new.min_optical_depth))?;
            new.min_transmittance =
                at_least_0("min_transmittance", min_transmittance.unwrap_or(new.min_transmittance))?;
            if new.step <= 0.0 || !new.step.is_finite() {
                return Err(refused(format!("step is {}; expected a length in voxels above 0", new.step)));
            }
            if inner.marching != new {
                inner.marching = new;
                inner.backend.refresh_occupancy(&new);
                let last = inner.changes.len() - 1;
                inner.count(last);
            }
            Ok(())
        })
    }

    /// Names of the parameters.
    #[getter]
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.look(py, |inner| Ok(Parameter::all(inner.model()).iter().map(Parameter::name).collect()))
    }

    /// A copy of one parameter.
    fn get(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let found = self.look(py, |inner| Ok(Parameter::find(inner.model(), name)?.get(inner.model())))?;
        found.into_array(py)
    }

    /// Copies of all parameters by name.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = self.look(py, |inner| {
            let model = inner.model();
            Ok(Parameter::all(model).iter().map(|p| (p.name(), p.get(model))).collect::<Vec<_>>())
        })?;
        let all = PyDict::new(py);
        for (name, values) in found {
            all.set_item(name, values.into_array(py)?)?;
        }
        Ok(all)
    }

    /// Takes new values for one parameter, of the same shape.
    fn set(&self, py: Python<'_>, name: String, value: Array<'_, f32>) -> PyResult<()> {
        let given = Given::new(name, &value);
        py.detach(|| self.write()?.take(&given))
    }

    /// Node coordinates of the stored voxels, (V, 3) int32. Bricks of 4 × 4 × 4 are stored whole, so some lie beyond the last node.
    #[getter]
    fn voxels(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let nodes: Vec<i32> = self.look(py, |inner| {
            let map = &inner.model().field.map;
            Ok((BRICK_VOXELS..map.voxels()).flat_map(|voxel| map.node(voxel)).map(|n| n as i32).collect())
        })?;
        let count = nodes.len() / 3;
        shaped(py, nodes, &[count, 3])
    }

    /// Nodes per axis (X, Y, Z).
    #[getter]
    fn resolution(&self, py: Python<'_>) -> PyResult<[u32; 3]> {
        self.look(py, |inner| Ok(inner.model().field.domain.resolution))
    }

    /// The box, lower and upper corner, (2, 3) [scene unit].
    #[getter]
    fn bounds(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let bounds = self.look(py, |inner| Ok(inner.model().field.domain.bounds))?;
        shaped(py, bounds.to_arrays().concat(), &[2, 3])
    }

    /// Density = density_scale * softplus(raw_density) [1 / scene unit].
    #[getter]
    fn density_scale(&self, py: Python<'_>) -> PyResult<f32> {
        self.look(py, |inner| Ok(inner.model().field.density_scale()))
    }

    /// What rays show: colour (..., 3) over the background, transmittance (...) and depth (...), the mean arc length times opacity [scene unit].
    ///
    /// origins, directions: (..., 3); directions need not be unit vectors.
    fn render(
        &self,
        py: Python<'_>,
        origins: Array<'_, f32>,
        directions: Array<'_, f32>,
    ) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
        let (colour, transmittance, depth, _) = self._render(py, origins, directions, None)?;
        Ok((colour, transmittance, depth))
    }

    /// render() once the model has taken values over by name, and how often each parameter had changed then.
    #[pyo3(signature = (origins, directions, values = None))]
    fn _render(
        &self,
        py: Python<'_>,
        origins: Array<'_, f32>,
        directions: Array<'_, f32>,
        values: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
        let (given, rays) = (values.map_or(Ok(Vec::new()), Given::all)?, Rays::new(&origins, &directions)?);
        let (all, changes) = self.compute(py, &given, |inner, cancel| {
            let mut all: Vec<Pixel<f32>> = Vec::with_capacity(rays.rays.len());
            for portion in rays.rays.chunks(PORTION) {
                go_on(cancel)?;
                all.extend(inner.backend.render(portion, &inner.marching, Layers::All));
            }
            Ok((all, inner.changes.clone()))
        })?;
        let (colour, count) = (all.iter().flat_map(|p| p.colour).collect(), changes.len());
        Ok((
            shaped(py, colour, &[&rays.shape[..], &[3]].concat())?,
            shaped(py, all.iter().map(|p| p.transmittance).collect(), &rays.shape)?,
            shaped(py, all.iter().map(|p| p.depth).collect(), &rays.shape)?,
            shaped(py, changes, &[count])?,
        ))
    }

    /// The vector-Jacobian product of render(): dLoss/d(each parameter, "origins" and "directions") by name.
    ///
    /// d_colour (..., 3) and d_transmittance (...) are dLoss/d(what rays show). Exact for the discrete march with its points held fixed. Depth has
    /// no derivative. Of paths whose derivatives overflow nothing is counted for the index.
    #[pyo3(signature = (origins, directions, d_colour, d_transmittance = None))]
    fn vjp<'py>(
        &self,
        py: Python<'py>,
        origins: Array<'py, f32>,
        directions: Array<'py, f32>,
        d_colour: Array<'py, f32>,
        d_transmittance: Option<Array<'py, f32>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self._vjp(py, origins, directions, d_colour, d_transmittance, None, None)
    }

    /// vjp() once the model has taken values over by name, where nothing else has changed since _render().
    #[pyo3(signature = (origins, directions, d_colour, d_transmittance = None, values = None, since = None))]
    #[allow(clippy::too_many_arguments, reason = "arguments of Python")]
    fn _vjp<'py>(
        &self,
        py: Python<'py>,
        origins: Array<'py, f32>,
        directions: Array<'py, f32>,
        d_colour: Array<'py, f32>,
        d_transmittance: Option<Array<'py, f32>>,
        values: Option<&Bound<'py, PyDict>>,
        since: Option<Vec<u32>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (given, rays) = (values.map_or(Ok(Vec::new()), Given::all)?, Rays::new(&origins, &directions)?);
        let d_pixels = adjoints(&rays, &d_colour, d_transmittance.as_ref())?;
        let found = self.compute(py, &given, |inner, cancel| {
            inner.check_unchanged(since.as_deref().unwrap_or_default(), &given)?;
            Gradients::of(inner, &rays, &d_pixels, cancel)
        })?;
        found.into_arrays(py, &rays)
    }
}
