//! What bends rays, as kernels read it: `Region` of `medium.wgsl`, `Lattice` of `lattice.wgsl`, coefficients and distances.

use crate::memory::Buffers;
use crate::{Gpu, GpuError};
use bytemuck::{Pod, Zeroable};
use refraxel_core::{Domain, IndexGrid, Interpolation};
use refraxel_train::Refraction;

/// Numbers of the interpolations in kernels.
pub(crate) const CUBIC_B_SPLINE: u32 = 0;
pub(crate) const TRILINEAR_OF_DIFFERENCES: u32 = 1;
pub(crate) const TRILINEAR: u32 = 2;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Region {
    lowest: [f32; 3],
    is_body: u32,
    highest: [f32; 3],
    is_uniform: u32,
    step: f32,
    interpolation: u32,
    padding: [u32; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Lattice {
    lowest: [f32; 3],
    first: u32,
    scale: [f32; 3],
    cells: u32,
    nodes: [u32; 3],
    voxel: f32,
}

/// All coefficients, and the distances of all cells.
#[derive(Default)]
struct Grids {
    lattices: Vec<Lattice>,
    coefficients: Vec<f32>,
    clearance: Vec<u8>,
}

impl Grids {
    /// Append a grid.
    fn push(&mut self, domain: &Domain<f32>, coefficients: &[f32], clearances: &[u8]) {
        let scale = domain.nodes_per_unit().hadamard(domain.unit_per_world());
        self.lattices.push(Lattice {
            lowest: domain.bounds.min.to_array(),
            first: self.coefficients.len() as u32,
            scale: scale.to_array(),
            cells: self.clearance.len() as u32,
            nodes: domain.resolution,
            voxel: domain.voxel(),
        });
        self.coefficients.extend(coefficients);
        self.clearance.extend(clearances);
    }
}

impl Region {
    fn of(grid: &IndexGrid<f32>, step: f32) -> Self {
        let bounds = &grid.domain().bounds;
        let interpolation = match grid.interpolation() {
            Interpolation::CubicBSpline => CUBIC_B_SPLINE,
            Interpolation::TrilinearOfDifferences => TRILINEAR_OF_DIFFERENCES,
            Interpolation::Trilinear => TRILINEAR,
        };
        Self {
            lowest: bounds.min.to_array(),
            is_body: grid.level_set().is_some().into(),
            highest: bounds.max.to_array(),
            is_uniform: grid.interior_index().is_some().into(),
            step,
            interpolation,
            padding: [0; 2],
        }
    }
}

/// Arrays with everything that kernels read of a medium.
pub(crate) fn upload(gpu: &Gpu, b: &mut Buffers, refraction: &Refraction) -> Result<(), GpuError> {
    let (mut grids, mut regions) = (Grids::default(), Vec::new());
    for grid in refraction.medium.regions() {
        // h of theory (2.9).
        let step = refraction.optics.step * grid.voxel() / grid.largest_index();
        regions.push(Region::of(grid, step));
        grids.push(grid.domain(), grid.coefficients(), grid.clearances());
        match grid.level_set() {
            Some(level) => grids.push(level.domain(), level.coefficients(), level.clearances()),
            None => grids.lattices.push(Lattice::default()),
        }
    }
    grids.clearance.resize(grids.clearance.len().next_multiple_of(4), 0);
    for bytes in [4 * grids.coefficients.len() as u64, grids.clearance.len() as u64] {
        if bytes > gpu.binding_limit() {
            let (what, adapter) = ("the index of refraction", gpu.adapter().name.clone());
            return Err(GpuError::TooLarge { what, adapter, needed: bytes, most: gpu.binding_limit() });
        }
    }
    b.filled(gpu, "regions", &regions)?;
    b.filled(gpu, "lattices", &grids.lattices)?;
    b.filled(gpu, "coefficients", &grids.coefficients)?;
    b.filled(gpu, "clearance", &grids.clearance)
}
