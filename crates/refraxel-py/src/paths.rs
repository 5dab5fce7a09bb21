//! Traced rays and the transpose of tracing.

use crate::arrays::{Array, Rays, of_vectors, shaped, vectors};
use crate::errors::refused;
use crate::index_parameters::entries;
use crate::interruptible::{for_each, go_on, interruptible};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use refraxel_core::index::MediumGradient;
use refraxel_core::optics::{Integrator, Options, PathAdjoint, PathEnd, RayAdjoint};
use refraxel_core::segment::SegmentAdjoint;
use refraxel_core::{Domain, Medium, Path, Tracer, Vec3};
use refraxel_train::cancel::Cancel;
use std::sync::Arc;

/// Rays whose gradients are summed by one thread, in order: results do not depend on the number of threads.
const CHUNK: usize = 256;

/// Paths of rays through a medium.
#[pyclass(frozen, module = "refraxel")]
pub struct Paths {
    medium: Arc<Medium<f64>>,
    domain: Domain<f64>,
    options: Options<f64>,
    rays: Rays<f64>,
    paths: Vec<Path<f64>>,
}

impl Paths {
    /// Traces rays.
    pub fn trace(
        py: Python<'_>,
        medium: Arc<Medium<f64>>,
        domain: Domain<f64>,
        options: Options<f64>,
        (origins, directions): (&Array<'_, f64>, &Array<'_, f64>),
    ) -> PyResult<Self> {
        let rays = Rays::new(origins, directions)?;
        let tracer = Tracer::new(&medium, &domain, options);
        let paths = for_each(py, &rays.rays, |ray| tracer.trace(ray))?;
        Ok(Self { medium, domain, options, rays, paths })
    }

    fn exits(&self) -> impl Iterator<Item = refraxel_core::Ray<f64>> + '_ {
        self.paths.iter().map(|p| p.exit)
    }
}

#[pymethods]
impl Paths {
    fn __len__(&self) -> usize {
        self.paths.len()
    }

    /// Where rays leave, (..., 3) [scene unit].
    #[getter]
    fn origins(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        of_vectors(py, self.exits().map(|r| r.origin), &self.rays.shape)
    }

    /// Unit directions in which rays leave, (..., 3).
    #[getter]
    fn directions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        of_vectors(py, self.exits().map(|r| r.direction), &self.rays.shape)
    }

    /// Whether rays left all regions, (...); False for those that were given up.
    #[getter]
    fn escaped(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let escaped = self.paths.iter().map(|p| p.end == PathEnd::Escaped).collect();
        shaped::<bool>(py, escaped, &self.rays.shape)
    }

    /// How often rays met a sharp surface, (...).
    #[getter]
    fn events(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        shaped(py, self.paths.iter().map(|p| p.events().count() as u32).collect(), &self.rays.shape)
    }

    /// The corners of the path of a ray, numbered in C order, (n, 3) [scene unit].
    fn points(&self, py: Python<'_>, ray: usize) -> PyResult<Py<PyAny>> {
        let count = self.paths.len();
        let path = self
            .paths
            .get(ray)
            .ok_or_else(|| refused(format!("there is no ray {ray}; there are {count}, from 0")))?;
        let points = path.segments.iter().map(|s| s.start).chain([path.exit.origin]);
        of_vectors(py, points, &[path.segments.len() + 1])
    }

    /// dLoss/d("origins", "directions", "index.k", "surface.k") from dLoss/d(exit origins and directions), each (..., 3), 0 if absent.
    ///
    /// Exact with the lengths and number of steps and the order of events held fixed. "index.k" is () for a body of one index, else (X, Y, Z) by
    /// control values n; "surface.k" (X, Y, Z) by the coefficients of the level set.
    #[pyo3(signature = (d_origins = None, d_directions = None))]
    fn vjp<'py>(
        &self,
        py: Python<'py>,
        d_origins: Option<Array<'py, f64>>,
        d_directions: Option<Array<'py, f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        if self.options.integrator == Integrator::RungeKutta4 {
            return Err(refused(
                "paths of the integrator runge_kutta have no derivatives; trace with leapfrog",
            ));
        }
        let given = |name: &str, array: Option<Array<'py, f64>>| -> PyResult<Vec<Vec3<f64>>> {
            let Some(array) = array else { return Ok(vec![Vec3::zero(); self.paths.len()]) };
            let (vectors, shape) = vectors(name, &array)?;
            let expected = &self.rays.shape;
            let fits = &shape == expected;
            fits.then_some(vectors).ok_or_else(|| {
                refused(format!(
                    "{name} has the shape {shape:?} + [3]; expected {expected:?} + [3], as the rays have"
                ))
            })
        };
        let (d_origins, d_directions) =
            (given("d_origins", d_origins)?, given("d_directions", d_directions)?);
        let (d_rays, gradient) = interruptible(py, |cancel| self.adjoint(&d_origins, &d_directions, cancel))?;
        let (all, shape) = (PyDict::new(py), &self.rays.shape);
        all.set_item("origins", of_vectors(py, d_rays.iter().map(|d| d.origin), shape)?)?;
        let directions = d_rays.iter().enumerate().map(|(k, d)| self.rays.direction_vjp(k, d.direction));
        all.set_item("directions", of_vectors(py, directions, shape)?)?;
        for (name, gradient) in entries(py, &self.medium, gradient)? {
            all.set_item(name, gradient)?;
        }
        Ok(all)
    }
}

impl Paths {
    /// dLoss/d(rays) and the sum of dLoss/d(medium).
    fn adjoint(
        &self,
        d_origins: &[Vec3<f64>],
        d_directions: &[Vec3<f64>],
        cancel: &Cancel,
    ) -> PyResult<(Vec<RayAdjoint<f64>>, MediumGradient<f64>)> {
        let tracer = Tracer::new(&self.medium, &self.domain, self.options);
        let chunk = |first: usize| {
            let mut gradient = self.medium.zero_gradient();
            let of = |k: usize| {
                let (path, exit) =
                    (&self.paths[k], RayAdjoint { origin: d_origins[k], direction: d_directions[k] });
                let segments = vec![SegmentAdjoint::default(); path.segments.len()];
                let d = PathAdjoint { segments: &segments, reflections: &[], exit };
                tracer.vjp(&self.rays.rays[k], path, &d, &mut gradient)
            };
            let d_rays: Vec<RayAdjoint<f64>> =
                (first..(first + CHUNK).min(self.paths.len())).map(of).collect();
            (d_rays, gradient)
        };
        let starts: Vec<usize> = (0..self.paths.len()).step_by(CHUNK).collect();
        let (mut d_rays, mut sum) = (Vec::new(), self.medium.zero_gradient());
        // A few chunks at a time: each holds a gradient of the whole medium.
        for starts in starts.chunks(rayon::current_num_threads()) {
            go_on(cancel)?;
            let parts: Vec<_> = starts.par_iter().map(|&first| chunk(first)).collect();
            for (rays, part) in parts {
                d_rays.extend(rays);
                let sums = sum.index.iter_mut().chain(&mut sum.level_set);
                for (sum, part) in sums.zip(part.index.iter().chain(&part.level_set)) {
                    sum.iter_mut().zip(part).for_each(|(a, b)| *a += b);
                }
            }
        }
        Ok((d_rays, sum))
    }
}
