//! numpy arrays and the vectors of the libraries. Arrays of another number type or layout are converted; those that go back
//! take over the memory of the library without a copy.

use crate::errors::refused;
use numpy::{
    AllowTypeChange, Element, PyArray, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods, PyUntypedArrayMethods,
};
use pyo3::Borrowed;
use pyo3::prelude::*;
use refraxel_core::{Aabb, Ray, Real, Vec3, vec3};
use std::ops::{Deref, RangeInclusive};

/// An array of any shape and type of real numbers.
pub struct Array<'py, T: Element>(PyArrayLikeDyn<'py, T, AllowTypeChange>);

impl<'py, T: Element> Deref for Array<'py, T> {
    type Target = PyArrayLikeDyn<'py, T, AllowTypeChange>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<'a, 'py, T: Element> FromPyObject<'a, 'py> for Array<'py, T>
where
    PyArrayLikeDyn<'py, T, AllowTypeChange>: FromPyObject<'a, 'py, Error = PyErr>,
{
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let kind = object.getattr("dtype").and_then(|dtype| dtype.getattr("kind")?.extract::<String>());
        if kind.is_ok_and(|kind| kind == "c") {
            return Err(refused("the array is complex; expected real numbers"));
        }
        object.extract().map(Self)
    }
}

/// Numbers in the order of rows, the last axis fastest.
pub fn values<T: Element + Copy>(array: &Array<'_, T>) -> Vec<T> {
    array.as_array().iter().copied().collect()
}

/// Numbers in the order of grids, the first axis (x) fastest.
pub fn x_fastest<T: Element + Copy>(array: &Array<'_, T>) -> Vec<T> {
    array.as_array().t().iter().copied().collect()
}

/// The shape of a grid of scalars.
pub fn grid_shape<T: Element>(name: &str, array: &Array<'_, T>) -> PyResult<[u32; 3]> {
    match *array.shape() {
        [x, y, z] => Ok([x as u32, y as u32, z as u32]),
        ref found => Err(refused(format!("{name} has the shape {found:?}; expected (X, Y, Z)"))),
    }
}

/// Vectors from an array of the shape (..., 3), and the axes before the last.
pub fn vectors<T: Real + Element>(name: &str, array: &Array<'_, T>) -> PyResult<(Vec<Vec3<T>>, Vec<usize>)> {
    let shape = array.shape();
    let Some((&3, before)) = shape.split_last() else {
        return Err(refused(format!("{name} has the shape {shape:?}; expected (..., 3)")));
    };
    let flat = values(array);
    if let Some(k) = flat.iter().position(|v| !v.is_finite()) {
        return Err(refused(format!("{name}: vector {} is not finite", k / 3)));
    }
    let vectors = flat.as_chunks::<3>().0.iter().map(|&[x, y, z]| vec3(x, y, z)).collect();
    Ok((vectors, before.to_vec()))
}

/// Rays, and what their directions were before they became unit vectors.
pub struct Rays<T> {
    /// Of unit direction.
    pub rays: Vec<Ray<T>>,
    /// The lengths of the directions.
    pub lengths: Vec<T>,
    /// The axes of the arrays before the last.
    pub shape: Vec<usize>,
}

impl<T: Real + Element> Rays<T> {
    /// Rays of two arrays of the same shape (..., 3).
    pub fn new(origins: &Array<'_, T>, directions: &Array<'_, T>) -> PyResult<Self> {
        let (origins, shape) = vectors("origins", origins)?;
        let (directions, found) = vectors("directions", directions)?;
        if found != shape {
            return Err(refused(format!(
                "directions have the shape {found:?} + [3], origins {shape:?} + [3]; expected the same"
            )));
        }
        // The largest component goes first: squares of very long and very short vectors have no place among the numbers.
        let scales: Vec<T> = directions.iter().map(|d| d.map(T::abs).max_element()).collect();
        if let Some(k) = scales.iter().position(|s| *s < T::min_positive_value()) {
            return Err(refused(format!("directions: vector {k} is zero; expected a direction")));
        }
        let scaled: Vec<Vec3<T>> = directions.into_iter().zip(&scales).map(|(d, &s)| d / s).collect();
        let lengths: Vec<T> = scaled.iter().zip(&scales).map(|(d, &s)| d.length() * s).collect();
        if let Some(k) = lengths.iter().position(|l| !l.is_finite()) {
            return Err(refused(format!("directions: vector {k} is too long; expected a finite length")));
        }
        let ray = |(origin, d): (Vec3<T>, Vec3<T>)| Ray { origin, direction: d.normalized() };
        let rays = origins.into_iter().zip(scaled).map(ray).collect();
        Ok(Self { rays, lengths, shape })
    }

    /// dLoss/d(direction as given) from that by the unit direction u = d/|d|: the tangential part over |d|.
    pub fn direction_vjp(&self, ray: usize, d_unit: Vec3<T>) -> Vec3<T> {
        let u = self.rays[ray].direction;
        (d_unit - u * u.dot(d_unit)) * self.lengths[ray].recip()
    }
}

/// Takes numbers, the last axis fastest, over into an array.
pub fn shaped<T: Element>(py: Python<'_>, values: Vec<T>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    let flat = PyArray::from_vec(py, values);
    let array: Bound<'_, PyArrayDyn<T>> = flat.reshape(shape)?;
    Ok(array.into_any().unbind())
}

/// Takes numbers of a grid, x fastest, over into an array that is indexed [x, y, z, ...]. `inner`: axes within a node.
pub fn grid<T: Element>(py: Python<'_>, values: Vec<T>, [x, y, z]: [u32; 3]) -> PyResult<Py<PyAny>> {
    let array = shaped(py, values, &[z as usize, y as usize, x as usize])?;
    Ok(array.bind(py).getattr("T")?.unbind())
}

/// Vectors as an array of the shape `before` + [3].
pub fn of_vectors<T: Real + Element>(
    py: Python<'_>,
    vectors: impl IntoIterator<Item = Vec3<T>>,
    before: &[usize],
) -> PyResult<Py<PyAny>> {
    let values = vectors.into_iter().flat_map(|v| v.to_array()).collect();
    shaped(py, values, &[before, &[3]].concat())
}

/// One vector of three numbers.
pub fn vector(name: &str, array: &Array<'_, f64>) -> PyResult<Vec3<f64>> {
    match vectors(name, array)? {
        (vectors, before) if before.is_empty() => Ok(vectors[0]),
        (_, before) => Err(refused(format!("{name} has the shape {before:?} + [3]; expected (3,)"))),
    }
}

/// Edges that a box may have [scene unit]: their squares and reciprocals keep their precision in single precision.
const EDGES: RangeInclusive<f64> = 1e-9..=1e9;

/// A box from its two corners (2, 3) [scene unit], that of single precision told apart from its surroundings.
pub fn bounds(corners: &Array<'_, f64>) -> PyResult<Aabb<f64>> {
    let [min, max] = vectors("bounds", corners)?.0[..] else {
        return Err(refused(format!(
            "bounds have the shape {:?}; expected (2, 3): the lower corner, then the upper one",
            corners.shape()
        )));
    };
    let found = Aabb::new(min, max);
    let farthest = min.map(f64::abs).max(max.map(f64::abs)).max_element();
    let is_edge = |edge: f64| EDGES.contains(&edge) && edge >= LEAST_SHARE * farthest;
    if found.extent().to_array().into_iter().all(is_edge) {
        return Ok(found);
    }
    Err(refused(format!(
        "bounds from {:?} to {:?}; expected a lower corner, then an upper one, edges from {:e} to {:e} scene units, and no edge below \
         {LEAST_SHARE:e} of the distance to the origin: move or scale the scene",
        min.to_array(),
        max.to_array(),
        EDGES.start(),
        EDGES.end()
    )))
}

/// Least edge of a box as a share of its distance to the origin: a thousand steps of single precision.
const LEAST_SHARE: f64 = 1e-4;
