//! numpy arrays and the vectors of the libraries. Arrays of another number type or layout are converted; those that go back
//! take over the memory of the library without a copy.

use crate::errors::refused;
use numpy::{
    AllowTypeChange, Element, PyArray, PyArrayDyn, PyArrayLikeDyn, PyArrayMethods, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use refraxel_core::{Aabb, Ray, Real, Vec3, vec3};

/// An array of any shape and number type.
pub type Array<'py, T> = PyArrayLikeDyn<'py, T, AllowTypeChange>;

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
        let lengths: Vec<T> = directions.iter().map(|d| d.length()).collect();
        if let Some(k) = lengths.iter().position(|l| *l <= T::zero()) {
            return Err(refused(format!("directions: vector {k} is zero; expected a direction")));
        }
        let ray = |(origin, (d, &l)): (Vec3<T>, (Vec3<T>, &T))| Ray { origin, direction: d * l.recip() };
        let rays = origins.into_iter().zip(directions.into_iter().zip(&lengths)).map(ray).collect();
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

/// A box from its two corners (2, 3) [scene unit].
pub fn bounds(corners: &Array<'_, f64>) -> PyResult<Aabb<f64>> {
    match vectors("bounds", corners)?.0[..] {
        [min, max] if (0..3).all(|a| min[a] < max[a]) => Ok(Aabb::new(min, max)),
        _ => Err(refused("bounds are no box; expected (2, 3): the lower corner, then the upper one")),
    }
}
