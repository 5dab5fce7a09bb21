//! Fields of the index of refraction and bodies, for tracing rays and for models.

use crate::arrays::{Array, bounds, grid_shape, of_vectors, shaped, vectors, x_fastest};
use crate::errors::{input, refused};
use crate::interruptible::for_each;
use crate::paths::Paths;
use pyo3::prelude::*;
use refraxel_core::optics::{Integrator, Options};
use refraxel_core::{Aabb, Domain, Extent, IndexGrid, Interpolation, LevelSet, Vec3};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// Least nodes per axis of a grid of the index: a border of three on each side, and one between.
const LEAST: u32 = 7;

/// Indices of refraction that rays are traced through: far beyond all matter, and squares keep their precision.
const INDICES: RangeInclusive<f64> = 0.01..=100.0;

/// One refractive region: a graded index in a box, or a body with a sharp surface.
#[pyclass(frozen, module = "refraxel", from_py_object)]
#[derive(Clone)]
pub struct Region(pub IndexGrid<f64>);

/// Refractive regions in vacuum. Where bodies overlap, the last one rules. Double precision.
#[pyclass(frozen, module = "refraxel")]
pub struct Medium(pub Arc<refraxel_core::Medium<f64>>);

/// The value of a list, x fastest, at the node where `x` lies.
fn at_node(values: &[f64], bounds: Aabb<f64>, [nx, ny, nz]: [u32; 3]) -> impl Fn(Vec3<f64>) -> f64 {
    let extent = bounds.extent();
    move |x| {
        let of = |a: usize, n: u32| ((x[a] - bounds.min[a]) / extent[a] * f64::from(n - 1)).round() as usize;
        values[of(0, nx) + nx as usize * (of(1, ny) + ny as usize * of(2, nz))]
    }
}

/// Numbers of the nodes at the border of a grid, x fastest.
fn border([nx, ny, nz]: [u32; 3]) -> impl Iterator<Item = usize> {
    let (nx, ny, nz) = (nx as usize, ny as usize, nz as usize);
    let is_end = |k: usize, n: usize| k == 0 || k == n - 1;
    (0..nx * ny * nz)
        .filter(move |k| is_end(k % nx, nx) || is_end(k / nx % ny, ny) || is_end(k / (nx * ny), nz))
}

fn check_nodes(name: &str, shape: [u32; 3], values: &[f64]) -> PyResult<()> {
    if shape.iter().any(|n| *n < LEAST) || !values.iter().all(|v| v.is_finite()) {
        return Err(refused(format!(
            "{name} has the shape {shape:?}; expected at least {LEAST} nodes per axis and finite numbers"
        )));
    }
    Ok(())
}

#[pymethods]
impl Region {
    /// A graded index n > 0 on the nodes of a box, (X, Y, Z), at least 7 per axis; vacuum outside.
    ///
    /// The field is a cubic spline through the values, except in the three outermost layers, which are held at 1. blurred: the values are its control
    /// values instead (blurred by 1/3 voxel² of variance), which does not ring beside kinks.
    #[staticmethod]
    #[pyo3(signature = (index, bounds, *, blurred = false))]
    fn graded(
        py: Python<'_>,
        index: Array<'_, f64>,
        bounds: Array<'_, f64>,
        blurred: bool,
    ) -> PyResult<Self> {
        let (shape, values, bounds) =
            (grid_shape("index", &index)?, x_fastest(&index), self::bounds(&bounds)?);
        check_nodes("index", shape, &values)?;
        if let Some(n) = values.iter().find(|n| !INDICES.contains(n)) {
            return Err(refused(format!("index has the value {n}; expected {INDICES:?}, 1 in vacuum")));
        }
        let (spline, at) = (Interpolation::CubicBSpline, at_node(&values, bounds, shape));
        let mut grid = py.detach(|| {
            if blurred {
                IndexGrid::from_control_values(bounds, shape, spline, at)
            } else {
                IndexGrid::from_samples(bounds, shape, spline, at)
            }
        });
        if grid.coefficients().iter().any(|c| *c <= 0.0) {
            return Err(refused(
                "index jumps so much from node to node that its spline is not positive; smooth it, pass blurred=True, or \
                 describe the jump as the surface of a Region.body",
            ));
        }
        // Every node has a derivative, also where the field is flat.
        py.detach(|| grid.find_flat_cells(Some(&vec![true; values.len()])));
        Ok(Self(grid))
    }

    /// A body where `distance` < 0: signed distances on the nodes of a box, (X, Y, Z) [scene unit], at least 7 per axis, positive at the border.
    ///
    /// index: n inside. absorption of red, green and blue [1 / scene unit].
    #[staticmethod]
    #[pyo3(signature = (distance, bounds, *, index = 1.5, absorption = [0.0; 3]))]
    fn body(
        py: Python<'_>,
        distance: Array<'_, f64>,
        bounds: Array<'_, f64>,
        index: f64,
        absorption: [f64; 3],
    ) -> PyResult<Self> {
        let (shape, values) = (grid_shape("distance", &distance)?, x_fastest(&distance));
        check_nodes("distance", shape, &values)?;
        let bounds = self::bounds(&bounds)?;
        if !INDICES.contains(&index) || !absorption.iter().all(|a| (0.0..=1e30).contains(a)) {
            return Err(refused(format!(
                "a body of index {index} and absorption {absorption:?}; expected an index in {INDICES:?} and absorption >= 0"
            )));
        }
        if border(shape).any(|node| values[node] <= 0.0) {
            return Err(refused(
                "distance is not positive everywhere at the border of its box; expected a body inside the box, negative inside \
                 the body: make the box larger, or change the sign",
            ));
        }
        let level = py.detach(|| LevelSet::from_samples(bounds, shape, at_node(&values, bounds, shape)));
        let mut grid = IndexGrid::sharp(level, index);
        grid.set_absorption(absorption);
        Ok(Self(grid))
    }
}

impl Medium {
    /// The medium of a run.
    pub fn of(medium: refraxel_core::Medium<f64>) -> Self {
        Self(Arc::new(medium))
    }

    /// The box around all regions.
    fn bounds(&self) -> Option<Aabb<f64>> {
        let boxes = self.0.regions().iter().map(|r| r.domain().bounds);
        Aabb::around(boxes.flat_map(|b| [b.min, b.max]))
    }
}

#[pymethods]
impl Medium {
    /// The medium of these regions. Regions without a surface may touch, but not overlap, others.
    #[new]
    fn new(regions: Vec<Region>) -> PyResult<Self> {
        let regions = regions.into_iter().map(|r| r.0).collect();
        refraxel_core::Medium::new(regions).map(Self::of).map_err(input)
    }

    fn __len__(&self) -> usize {
        self.0.regions().len()
    }

    /// The index of refraction at points (..., 3) [scene unit].
    fn index(&self, py: Python<'_>, points: Array<'_, f64>) -> PyResult<Py<PyAny>> {
        let (points, shape) = vectors("points", &points)?;
        let found = for_each(py, &points, |&x| self.0.index(x))?;
        shaped(py, found, &shape)
    }

    /// The gradient of the index at points (..., 3) [1 / scene unit], without the jumps at surfaces.
    fn gradient(&self, py: Python<'_>, points: Array<'_, f64>) -> PyResult<Py<PyAny>> {
        let (points, shape) = vectors("points", &points)?;
        let found = for_each(py, &points, |&x| self.0.gradient(x) * self.0.index(x).recip())?;
        of_vectors(py, found, &shape)
    }

    /// Traces rays by the ray equation and Snell's law.
    ///
    /// origins, directions: (..., 3). bounds: the box in which rays are followed, that around all regions if absent. step: longest step [voxel].
    /// max_segments: a path that has more is given up, see Paths.escaped.
    #[pyo3(signature = (origins, directions, *, bounds = None, step = 0.5, integrator = "leapfrog", max_segments = 4096))]
    #[allow(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn trace(
        &self,
        py: Python<'_>,
        origins: Array<'_, f64>,
        directions: Array<'_, f64>,
        bounds: Option<Array<'_, f64>>,
        step: f64,
        integrator: &str,
        max_segments: usize,
    ) -> PyResult<Paths> {
        let integrator = match integrator {
            "leapfrog" => Integrator::Leapfrog,
            "euler" => Integrator::ExplicitEuler,
            "runge_kutta" => Integrator::RungeKutta4,
            _ => {
                return Err(refused(format!(
                    "integrator is {integrator:?}; expected leapfrog, euler or runge_kutta"
                )));
            }
        };
        if !(step > 0.0 && step <= 1.0) {
            return Err(refused(format!(
                "step is {step}; expected a share of a voxel, above 0 and at most 1"
            )));
        }
        if max_segments == 0 {
            return Err(refused("max_segments is 0; expected a number from 1 on"));
        }
        if integrator != Integrator::Leapfrog && self.0.regions().iter().any(|r| r.level_set().is_some()) {
            return Err(refused("bodies with a surface are traced by the leapfrog integrator alone"));
        }
        let bounds = match (bounds, self.bounds()) {
            (Some(bounds), _) => self::bounds(&bounds)?,
            (None, Some(bounds)) => bounds,
            (None, None) => {
                return Err(refused("a medium without regions needs bounds to say where rays end"));
            }
        };
        let domain = Domain { bounds, extent: Extent::Bounded, resolution: [2; 3] };
        let options = Options { integrator, step, max_segments, ..Options::default() };
        Paths::trace(py, Arc::clone(&self.0), domain, options, (&origins, &directions))
    }
}
