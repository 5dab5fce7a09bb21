//! Models of arrays.

use crate::arrays::{Array, grid_shape, values, x_fastest};
use crate::errors::refused;
use crate::medium::Medium;
use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use refraxel_core::sh::{self, ShDegree};
use refraxel_core::{Aabb, Background, BrickMap, Domain, EnvironmentMap, Extent, VoxelField, vec3};
use refraxel_train::Refraction;
use refraxel_train::model::RegionState;

/// The field of a grid of densities σ (X, Y, Z) and of colours (X, Y, Z, 3), or SH coefficients (X, Y, Z, 3, basis).
pub fn field(
    py: Python<'_>,
    density: &Array<'_, f32>,
    colour: &Array<'_, f32>,
    bounds: Aabb<f64>,
) -> PyResult<VoxelField<f32>> {
    let shape = grid_shape("density", density)?;
    if shape.iter().any(|n| *n < 2) {
        return Err(refused(format!("density has the shape {shape:?}; expected at least 2 nodes per axis")));
    }
    let degree = degree(shape, colour.shape())?;
    let domain = Domain { bounds: bounds.cast(), extent: Extent::Bounded, resolution: shape };
    // The SH basis function of degree 0, the same in all directions.
    let (is_sh, constant) = (colour.ndim() == 5, sh::basis(degree, vec3(0.0, 0.0, 1.0))[0]);
    let (sigmas, colours) = (x_fastest(density), values(colour));
    if sigmas.iter().any(|s| !(s.is_finite() && *s >= 0.0)) || !colours.iter().all(|c| c.is_finite()) {
        return Err(refused(
            "density or colour has values that are negative or not finite; expected density >= 0",
        ));
    }
    let (per_node, [nx, ny, nz]) = (colours.len() / sigmas.len(), shape.map(|n| n as usize));
    Ok(py.detach(|| {
        let mut field = VoxelField::uniform(domain, BrickMap::dense(shape), degree, 0.0);
        let (scale, stride) = (field.density_scale(), degree.stride());
        for (node, sigma) in sigmas.iter().enumerate() {
            let [x, y, z] = [node % nx, node / nx % ny, node / (nx * ny)];
            let voxel = field.map.voxel([x, y, z].map(|n| n as u32));
            field.density[voxel] = raw(sigma / scale);
            let own = &colours[((x * ny + y) * nz + z) * per_node..][..per_node];
            for (k, &value) in own.iter().enumerate() {
                field.colour[voxel * stride + k] = if is_sh { value } else { (value - 0.5) / constant };
            }
        }
        field
    }))
}

/// θ of softplus(θ) = x, at least that of empty space.
fn raw(x: f32) -> f32 {
    let raw = if x > 20.0 { x } else { x.exp_m1().ln() };
    raw.max(refraxel_core::field::EMPTY_DENSITY as f32)
}

/// The degree that the shape of colours says.
fn degree([x, y, z]: [u32; 3], found: &[usize]) -> PyResult<ShDegree> {
    let expected = [x as usize, y as usize, z as usize, 3];
    let degrees = [(1, 0), (4, 1), (9, 2), (16, 3)];
    let degree = match found {
        _ if found == expected => Some(0),
        [before @ .., basis] if before == expected => degrees.iter().find(|d| d.0 == *basis).map(|d| d.1),
        _ => None,
    };
    degree.and_then(ShDegree::new).ok_or_else(|| {
        refused(format!(
            "colour has the shape {found:?}; expected {expected:?}, or {expected:?} + [1, 4, 9 or 16]"
        ))
    })
}

/// A colour (3), or a panorama (H, 2 H, 3).
pub fn background(array: &Array<'_, f32>) -> PyResult<Background<f32>> {
    let (shape, flat) = (array.shape(), values(array));
    if !flat.iter().all(|v| v.is_finite()) {
        return Err(refused("background has values that are not finite"));
    }
    match (shape, &flat[..]) {
        (_, &[r, g, b]) => Ok(Background::Constant([r, g, b])),
        (&[height, width, 3], _) if width == 2 * height && height > 0 => {
            let map = EnvironmentMap::from_texels(height, flat.as_chunks::<3>().0.to_vec());
            map.map(Background::Environment).ok_or_else(|| refused("background has no texels"))
        }
        _ => Err(refused(format!("background has the shape {shape:?}; expected (3,) or (H, 2 H, 3)"))),
    }
}

/// What bends the rays of a model. All nodes have derivatives.
pub fn refraction(medium: &Medium) -> Refraction {
    let medium: refraxel_core::Medium<f32> = medium.0.cast();
    let state = |r: &refraxel_core::IndexGrid<f32>| {
        let is_uniform = r.level_set().is_some() && r.interior_index().is_some();
        RegionState { trainable: vec![!is_uniform; r.coefficients().len()], ..RegionState::default() }
    };
    let states = medium.regions().iter().map(state).collect();
    let mut refraction = Refraction { medium, states, ..Refraction::none() };
    refraction.find_flat_cells();
    refraction
}
