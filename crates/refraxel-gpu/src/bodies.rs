//! What bends rays, as kernels read it: `Region` of `medium.wgsl`, `Lattice` of `lattice.wgsl`, coefficients and distances.

use crate::device::Device;
use crate::error::GpuError;
use crate::memory::Buffers;
use bytemuck::{Pod, Zeroable};
use refraxel_core::index::MediumGradient;
use refraxel_core::optics::transition;
use refraxel_core::radiance::LEAST_CONTRAST;
use refraxel_core::{Domain, IndexGrid, Interpolation, LevelSet};
use refraxel_train::Refraction;

/// Numbers of the interpolations in kernels.
pub(crate) const CUBIC_B_SPLINE: u32 = 0;
pub(crate) const TRILINEAR_OF_DIFFERENCES: u32 = 1;
pub(crate) const TRILINEAR: u32 = 2;

/// What surface a region has, in kernels: none, a spline that planes may cut, planes alone.
pub(crate) const NO_BODY: u32 = 0;
pub(crate) const BODY: u32 = 1;
pub(crate) const BODY_OF_PLANES: u32 = 2;

/// Regions that kernels know of, in arrays of this length: more than any file of bodies may have.
pub(crate) const MAX_REGIONS: usize = 64;

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
struct Region {
    lowest: [f32; 3],
    body: u32,
    highest: [f32; 3],
    is_uniform: u32,
    step: f32,
    interpolation: u32,
    contrast: f32,
    planes: u32,
    absorption: [f32; 3],
    first_plane: u32,
    gentlest: f32,
    padding: [u32; 3],
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
            body: match grid.level_set() {
                None => NO_BODY,
                Some(level) if level.is_of_planes() => BODY_OF_PLANES,
                Some(_) => BODY,
            },
            highest: bounds.max.to_array(),
            is_uniform: grid.interior_index().is_some().into(),
            step,
            interpolation,
            contrast: (grid.largest_index() - 1.0).max(LEAST_CONTRAST as f32),
            absorption: grid.absorption(),
            gentlest: transition::gentlest(grid),
            ..Self::default()
        }
    }
}

/// Arrays with everything that kernels read of a medium, over those of one of the same shape.
pub(crate) fn upload(device: &Device, b: &mut Buffers, refraction: &Refraction) -> Result<(), GpuError> {
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
    // Behind all coefficients, so that those of gradients stay where they are.
    for (region, grid) in regions.iter_mut().zip(refraction.medium.regions()) {
        let planes = grid.level_set().map_or(&[][..], LevelSet::planes);
        (region.first_plane, region.planes) = (grids.coefficients.len() as u32, planes.len() as u32);
        grids.coefficients.extend(planes.iter().flat_map(|(h, m)| [m.x, m.y, m.z, *h]));
    }
    grids.clearance.resize(grids.clearance.len().next_multiple_of(4), 0);
    let of_regions = |regions: usize| (regions * size_of::<Region>()) as u64;
    for (needed, most) in [
        (4 * grids.coefficients.len() as u64, device.binding_limit),
        (grids.clearance.len() as u64, device.binding_limit),
        (of_regions(regions.len()), of_regions(MAX_REGIONS)),
    ] {
        if needed > most {
            return Err(device.too_large("the index of refraction", needed, most));
        }
    }
    regions.resize(MAX_REGIONS, Region::default());
    grids.lattices.resize(2 * MAX_REGIONS, Lattice::default());
    b.put(device, "regions", &regions)?;
    b.put(device, "lattices", &grids.lattices)?;
    b.put(device, "coefficients", &grids.coefficients)?;
    b.put(device, "clearance", &grids.clearance)
}

/// Coefficients of the index and of the level sets of all regions.
pub(crate) fn coefficients(refraction: &Refraction) -> usize {
    let of_level = |grid: &IndexGrid<f32>| grid.level_set().map_or(0, |l| l.coefficients().len());
    let of = |grid| IndexGrid::coefficients(grid).len() + of_level(grid);
    refraction.medium.regions().iter().map(of).sum()
}

/// Numbers of the gradient of a medium: its coefficients, and three of what each region absorbs.
pub(crate) fn gradient_len(refraction: &Refraction) -> usize {
    coefficients(refraction) + 3 * refraction.medium.regions().len()
}

/// The gradient of a medium as kernels sum it up, by region; and that of what regions absorb.
pub(crate) fn gradient(refraction: &Refraction, sums: &[f64]) -> (MediumGradient<f32>, Vec<[f64; 3]>) {
    let mut gradient = refraction.medium.zero_gradient();
    let mut rest = sums;
    for (index, level_set) in gradient.index.iter_mut().zip(&mut gradient.level_set) {
        for d in index.iter_mut().chain(level_set) {
            let Some((first, others)) = rest.split_first() else { break };
            (*d, rest) = (*first as f32, others);
        }
    }
    (gradient, rest.as_chunks::<3>().0.to_vec())
}
