//! Models as differentiable functions of their parameters: rendering of rays, and its transpose.

mod fields;
mod parameters;

use crate::arrays::{Array, Rays, of_vectors, shaped, values};
use crate::errors::refused;
use crate::medium::{Medium, entries};
use parameters::Parameter;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Background, EnvironmentMap};
use refraxel_train::backend::{BatchGradient, Layers, Marching, PixelGradient};
use refraxel_train::{Backend, CpuBackend};
use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard};

/// Rays between two looks at signals: a fraction of a second.
const PORTION: usize = 16_384;

/// A voxel radiance field with its background and what bends rays: a differentiable function of parameters and rays.
///
/// Parameters, all float32: "raw_density" (V,), of which density_scale * softplus is the density [1 / scene unit]; "sh" (V, 3, basis), colour
/// = 0.5 + SH, clamped at 0; "background" (H, 2 H, 3), a panorama, H = 1 for one colour; and for region k "index.k": () for a body of one
/// index, else (X, Y, Z), control values n of a spline, of which the three outermost layers are held at 1; "surface.k" (X, Y, Z), coefficients of
/// the level set [scene unit]; "absorption.k" (3,) [1 / scene unit]. What surfaces mirror is held fixed.
#[pyclass(frozen, module = "refraxel")]
pub struct Model(RwLock<Inner>);

/// A backend and how its rays are marched.
struct Inner {
    backend: CpuBackend,
    marching: Marching,
}

impl Inner {
    fn model(&self) -> &refraxel_train::Model {
        // A CPU's snapshot borrows.
        self.backend.model()
    }
}

impl Model {
    /// A model, with its background as a panorama: that of a constant colour has two texels.
    pub fn of(mut model: refraxel_train::Model, marching: Marching) -> Self {
        if let Background::Constant(colour) = model.background {
            model.background = Background::Environment(EnvironmentMap::uniform(1, colour));
        }
        let mut backend = CpuBackend::new(model);
        backend.refresh_occupancy(&marching);
        Self(RwLock::new(Inner { backend, marching }))
    }

    /// To look at.
    fn read(&self) -> PyResult<RwLockReadGuard<'_, Inner>> {
        self.0.read().map_err(|_| refused("the model is damaged: an earlier call failed"))
    }

    /// To change, without the interpreter's lock while somebody else renders.
    fn write(&self, py: Python<'_>) -> PyResult<RwLockWriteGuard<'_, Inner>> {
        loop {
            if let Ok(inner) = self.0.try_write() {
                return Ok(inner);
            }
            // Wait for whoever renders; then try again.
            py.detach(|| drop(self.0.read()));
            if self.0.is_poisoned() {
                return Err(refused("the model is damaged: an earlier call failed"));
            }
            py.check_signals()?;
        }
    }
}

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
    fn from_arrays(
        density: Array<'_, f32>,
        colour: Array<'_, f32>,
        bounds: Array<'_, f64>,
        background: Option<Array<'_, f32>>,
        medium: Option<&Medium>,
        step: f32,
    ) -> PyResult<Self> {
        let field = fields::field(&density, &colour, crate::arrays::bounds(&bounds)?)?;
        let background = background.map_or(Ok(Background::Constant([1.0; 3])), |b| fields::background(&b))?;
        let mut model = refraxel_train::Model::straight(field, background);
        if let Some(medium) = medium {
            model.refraction = fields::refraction(medium);
        }
        if !(step > 0.0 && step.is_finite()) {
            return Err(refused(format!("step is {step}; expected a length in voxels above 0")));
        }
        Ok(Self::of(model, Marching::exhaustive(step)))
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
        let inner = &mut *self.write(py)?;
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
        inner.marching = new;
        inner.backend.refresh_occupancy(&new);
        Ok(())
    }

    /// Names of the parameters.
    #[getter]
    fn names(&self) -> PyResult<Vec<String>> {
        Ok(Parameter::all(self.read()?.model()).iter().map(Parameter::name).collect())
    }

    /// A copy of one parameter.
    fn get(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let inner = self.read()?;
        Parameter::find(inner.model(), name)?.get(py, inner.model())
    }

    /// Copies of all parameters by name.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (inner, all) = (self.read()?, PyDict::new(py));
        for parameter in Parameter::all(inner.model()) {
            all.set_item(parameter.name(), parameter.get(py, inner.model())?)?;
        }
        Ok(all)
    }

    /// Takes new values for one parameter, of the same shape.
    fn set(&self, py: Python<'_>, name: &str, value: Array<'_, f32>) -> PyResult<()> {
        let inner = &mut *self.write(py)?;
        let parameter = Parameter::find(inner.model(), name)?;
        let change = parameter.checked(inner.model(), &value)?;
        py.detach(|| {
            inner.backend.edit(|model| parameter.set(model, &change));
            if parameter == Parameter::RawDensity {
                inner.backend.refresh_occupancy(&inner.marching);
            }
        });
        Ok(())
    }

    /// Node coordinates of the stored voxels, (V, 3) int32. Bricks of 4 × 4 × 4 are stored whole, so some lie beyond the last node.
    #[getter]
    fn voxels(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let inner = self.read()?;
        let map = &inner.model().field.map;
        let nodes = map.bricks().iter().flat_map(|brick| {
            (0..BRICK_VOXELS as u32)
                .map(|k| [4 * brick[0] + (k & 3), 4 * brick[1] + (k >> 2 & 3), 4 * brick[2] + (k >> 4)])
        });
        let nodes: Vec<i32> = nodes.flatten().map(|n| n as i32).collect();
        let count = nodes.len() / 3;
        shaped(py, nodes, &[count, 3])
    }

    /// Nodes per axis (X, Y, Z).
    #[getter]
    fn resolution(&self) -> PyResult<[u32; 3]> {
        Ok(self.read()?.model().field.domain.resolution)
    }

    /// The box, lower and upper corner, (2, 3) [scene unit].
    #[getter]
    fn bounds(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let bounds = self.read()?.model().field.domain.bounds;
        shaped(py, [bounds.min.to_array(), bounds.max.to_array()].concat(), &[2, 3])
    }

    /// Density = density_scale * softplus(raw_density) [1 / scene unit].
    #[getter]
    fn density_scale(&self) -> PyResult<f32> {
        Ok(self.read()?.model().field.density_scale())
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
        let (inner, rays) = (&*self.read()?, Rays::new(&origins, &directions)?);
        let mut all: Vec<Pixel<f32>> = Vec::with_capacity(rays.rays.len());
        for portion in rays.rays.chunks(PORTION) {
            py.check_signals()?;
            all.extend(py.detach(|| inner.backend.render(portion, &inner.marching, Layers::All)));
        }
        let colour = all.iter().flat_map(|p| p.colour).collect();
        Ok((
            shaped(py, colour, &[&rays.shape[..], &[3]].concat())?,
            shaped(py, all.iter().map(|p| p.transmittance).collect(), &rays.shape)?,
            shaped(py, all.iter().map(|p| p.depth).collect(), &rays.shape)?,
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
        let (inner, rays) = (&*self.read()?, Rays::new(&origins, &directions)?);
        let d_pixels = adjoints(&rays, &d_colour, d_transmittance.as_ref())?;
        py.check_signals()?;
        let gradient = py.detach(|| inner.backend.vjp(&rays.rays, &inner.marching, &d_pixels));
        inner.gradients(py, &rays, gradient)
    }
}

/// dLoss/d(pixel) of arrays.
fn adjoints(
    rays: &Rays<f32>,
    d_colour: &Array<'_, f32>,
    d_transmittance: Option<&Array<'_, f32>>,
) -> PyResult<Vec<PixelGradient>> {
    let (colour, transmittance) = (values(d_colour), d_transmittance.map(values));
    let count = rays.rays.len();
    if colour.len() != 3 * count || transmittance.as_ref().is_some_and(|t| t.len() != count) {
        return Err(refused(format!(
            "for {count} rays there are {} numbers in d_colour and {} in d_transmittance; expected the shapes that render gives",
            colour.len(),
            transmittance.map_or(0, |t| t.len())
        )));
    }
    let all = colour.as_chunks::<3>().0.iter().enumerate();
    Ok(all
        .map(|(k, &colour)| PixelGradient {
            colour,
            transmittance: transmittance.as_ref().map_or(0.0, |t| t[k]),
        })
        .collect())
}

impl Inner {
    /// dLoss/d(parameters and rays), by name.
    fn gradients<'py>(
        &self,
        py: Python<'py>,
        rays: &Rays<f32>,
        gradient: BatchGradient,
    ) -> PyResult<Bound<'py, PyDict>> {
        let (all, model) = (PyDict::new(py), self.model());
        let field = &model.field;
        // The first brick stands for empty space and learns nothing.
        let density = gradient.field.density[BRICK_VOXELS..].to_vec();
        let voxels = density.len();
        all.set_item("raw_density", shaped(py, density, &[voxels])?)?;
        let sh = parameters::unpadded(
            field.degree,
            &gradient.field.colour[BRICK_VOXELS * field.degree.stride()..],
        );
        all.set_item("sh", shaped(py, sh, &[voxels, 3, field.degree.basis()])?)?;
        let texels = gradient.background.into_flattened();
        all.set_item("background", shaped(py, texels, &parameters::panorama_shape(model))?)?;
        for (name, gradient) in entries(py, &model.refraction.medium, gradient.medium)? {
            all.set_item(name, gradient)?;
        }
        for (k, d) in gradient.absorption.into_iter().enumerate() {
            all.set_item(format!("absorption.{k}"), shaped(py, d.map(|d| d as f32).to_vec(), &[3])?)?;
        }
        let origins = gradient.rays.iter().map(|r| r.origin);
        all.set_item("origins", of_vectors(py, origins, &rays.shape)?)?;
        let directions = gradient.rays.iter().enumerate().map(|(k, r)| rays.direction_vjp(k, r.direction));
        all.set_item("directions", of_vectors(py, directions, &rays.shape)?)?;
        Ok(all)
    }
}
