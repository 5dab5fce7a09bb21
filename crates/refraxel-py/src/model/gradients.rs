//! Gradients of a model on their way to Python.

use super::parameters;
use super::state::{Inner, PORTION};
use crate::arrays::{Array, Rays, of_vectors, shaped, values};
use crate::errors::refused;
use crate::index_parameters::entries;
use crate::interruptible::go_on;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use refraxel_core::Ray;
use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::sh::ShDegree;
use refraxel_train::backend::{BatchGradient, PixelGradient};
use refraxel_train::cancel::Cancel;
use std::ops::AddAssign;

/// dLoss/d(pixel) of arrays.
pub fn adjoints(
    rays: &Rays<f32>,
    d_colour: &Array<'_, f32>,
    d_transmittance: Option<&Array<'_, f32>>,
) -> PyResult<Vec<PixelGradient>> {
    let expected = [&rays.shape[..], &[3]].concat();
    let is_wrong = |t: &Array<'_, f32>| t.shape() != rays.shape;
    if d_colour.shape() != expected || d_transmittance.is_some_and(is_wrong) {
        return Err(refused(format!(
            "d_colour has the shape {:?} and d_transmittance {:?}; expected {expected:?} and {:?}, the shapes that render gives",
            d_colour.shape(),
            d_transmittance.map_or(&[][..], |t| t.shape()),
            rays.shape
        )));
    }
    let (colour, transmittance) = (values(d_colour), d_transmittance.map(values));
    let all = colour.as_chunks::<3>().0.iter().enumerate();
    Ok(all
        .map(|(k, &colour)| PixelGradient {
            colour,
            transmittance: transmittance.as_ref().map_or(0.0, |t| t[k]),
        })
        .collect())
}

/// dLoss/d(parameters and rays), away from the interpreter.
pub struct Gradients {
    sum: BatchGradient,
    /// Of the field: its degree.
    degree: ShDegree,
    background: [usize; 3],
    /// The regions that the gradient belongs to.
    medium: refraxel_core::Medium<f32>,
}

impl Gradients {
    /// The sum over portions of the rays: memory is bounded by the largest portion and the model.
    pub fn of(
        inner: &Inner,
        rays: &Rays<f32>,
        d_pixels: &[PixelGradient],
        cancel: &Cancel,
    ) -> PyResult<Self> {
        let of = |rays: &[Ray<f32>], d: &[PixelGradient]| inner.backend.vjp(rays, &inner.marching, d);
        let mut portions = rays.rays.chunks(PORTION).zip(d_pixels.chunks(PORTION));
        let (first, d_first) = portions.next().unwrap_or_default();
        let mut sum = of(first, d_first);
        for (rays, d) in portions {
            go_on(cancel)?;
            add(&mut sum, of(rays, d));
        }
        let model = inner.model();
        let background = parameters::panorama_shape(model);
        Ok(Self { sum, degree: model.field.degree, background, medium: model.refraction.medium.clone() })
    }

    /// By name.
    pub fn into_arrays<'py>(self, py: Python<'py>, rays: &Rays<f32>) -> PyResult<Bound<'py, PyDict>> {
        let Self { sum, degree, background, medium } = self;
        let all = PyDict::new(py);
        // The first brick stands for empty space and learns nothing.
        let density = sum.field.density[BRICK_VOXELS..].to_vec();
        let voxels = density.len();
        all.set_item("raw_density", shaped(py, density, &[voxels])?)?;
        let sh = parameters::unpadded(degree, &sum.field.colour[BRICK_VOXELS * degree.stride()..]);
        all.set_item("sh", shaped(py, sh, &[voxels, 3, degree.basis()])?)?;
        all.set_item("background", shaped(py, sum.background.into_flattened(), &background)?)?;
        for (name, gradient) in entries(py, &medium, sum.medium)? {
            all.set_item(name, gradient)?;
        }
        for (k, d) in sum.absorption.into_iter().enumerate() {
            all.set_item(format!("absorption.{k}"), shaped(py, d.map(|d| d as f32).to_vec(), &[3])?)?;
        }
        let origins = sum.rays.iter().map(|r| r.origin);
        all.set_item("origins", of_vectors(py, origins, &rays.shape)?)?;
        let directions = sum.rays.iter().enumerate().map(|(k, r)| rays.direction_vjp(k, r.direction));
        all.set_item("directions", of_vectors(py, directions, &rays.shape)?)?;
        Ok(all)
    }
}

/// Adds another part of the same sum, of other rays.
fn add(sum: &mut BatchGradient, part: BatchGradient) {
    fn each<T: AddAssign + Copy>(sum: &mut [T], part: &[T]) {
        sum.iter_mut().zip(part).for_each(|(a, b)| *a += *b);
    }
    each(&mut sum.field.density, &part.field.density);
    each(&mut sum.field.colour, &part.field.colour);
    each(sum.background.as_flattened_mut(), part.background.as_flattened());
    each(sum.absorption.as_flattened_mut(), part.absorption.as_flattened());
    let regions = sum.medium.index.iter_mut().chain(&mut sum.medium.level_set);
    let parts = part.medium.index.iter().chain(&part.medium.level_set);
    regions.zip(parts).for_each(|(sum, part)| each(sum, part));
    sum.rays.extend(part.rays);
}
