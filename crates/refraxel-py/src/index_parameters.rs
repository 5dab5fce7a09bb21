//! Indices and surfaces of regions as the parameters that Python sees, and their gradients.

use crate::arrays::{grid, shaped};
use numpy::Element;
use pyo3::prelude::*;
use refraxel_core::index::MediumGradient;
use refraxel_core::{IndexGrid, Real};

/// dLoss/d(index and surface of each region), by their names. That by a node's n follows from the coefficient w = n²/2:
/// d_n = n d_w; that by the one index of a body is the sum.
pub fn entries<T: Real + Element>(
    py: Python<'_>,
    medium: &refraxel_core::Medium<T>,
    gradient: MediumGradient<T>,
) -> PyResult<Vec<(String, Py<PyAny>)>> {
    let mut all = Vec::new();
    for (k, ((region, by_index), by_surface)) in
        medium.regions().iter().zip(gradient.index).zip(gradient.level_set).enumerate()
    {
        let by_index: Vec<T> = indices(region).zip(by_index).map(|(n, d)| n * d).collect();
        let by_index = match one_index(region) {
            Some(_) => shaped(py, vec![by_index.into_iter().sum::<T>()], &[])?,
            None => grid(py, by_index, region.domain().resolution)?,
        };
        all.push((format!("index.{k}"), by_index));
        if let Some(level) = region.level_set() {
            all.push((format!("surface.{k}"), grid(py, by_surface, level.domain().resolution)?));
        }
    }
    Ok(all)
}

/// n = √(2w) of the coefficients of a region.
pub fn indices<T: Real>(region: &IndexGrid<T>) -> impl Iterator<Item = T> + '_ {
    region.coefficients().iter().map(|&w| (w + w).sqrt())
}

/// The one index of a body, where it has one.
pub fn one_index<T: Real>(region: &IndexGrid<T>) -> Option<T> {
    region.level_set().and(region.interior_index())
}
