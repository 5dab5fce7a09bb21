//! Moving a field to another grid by trilinear interpolation.

use rayon::prelude::*;
use refraxel_core::field::EMPTY_DENSITY;
use refraxel_core::grid::{BRICK_VOXELS, EMPTY_SLOT, trilinear};
use refraxel_core::{BrickMap, Domain, Vec3, VoxelField};

/// The field on another domain over the same box, with another set of bricks. Where the old field stores nothing, the
/// new one is empty.
pub fn resampled(old: &VoxelField<f32>, domain: Domain<f32>, map: BrickMap) -> VoxelField<f32> {
    let mut new = VoxelField::uniform(domain, map, old.degree, EMPTY_DENSITY as f32);
    let stride = new.degree.stride();
    // Both grids span the same contracted space, so node coordinates scale.
    let scale = Vec3::from(std::array::from_fn(|a| {
        (old.domain.resolution[a] - 1) as f32 / (domain.resolution[a] - 1) as f32
    }));
    let map = &new.map;
    let density = new.density.par_chunks_mut(BRICK_VOXELS);
    let colour = new.colour.par_chunks_mut(BRICK_VOXELS * stride);
    density.zip(colour).enumerate().skip(1).for_each(|(slot, (density, colour))| {
        for local in 0..BRICK_VOXELS {
            let node = map.node(slot * BRICK_VOXELS + local);
            let node: [u32; 3] = std::array::from_fn(|a| node[a].min(domain.resolution[a] - 1));
            let g = Vec3::from(node.map(|n| n as f32)).hadamard(scale);
            let to = &mut colour[local * stride..(local + 1) * stride];
            density[local] = interpolate(old, g, to);
        }
    });
    new
}

/// Raw density and coefficients at node coordinates of the old grid. Corners in absent bricks are left out of the
/// colour's average, so that the rim of a sparse field keeps its colour.
fn interpolate(old: &VoxelField<f32>, g: Vec3<f32>, colour: &mut [f32]) -> f32 {
    let stride = old.degree.stride();
    let n = old.map.resolution();
    let base: [u32; 3] = std::array::from_fn(|a| (g[a] as u32).min(n[a] - 2));
    let w = trilinear::weights(g - Vec3::from(base.map(|b| b as f32)));
    let (mut theta, mut present) = (0.0, 0.0);
    for (k, w) in w.into_iter().enumerate() {
        let node = [base[0] + (k as u32 & 1), base[1] + (k as u32 >> 1 & 1), base[2] + (k as u32 >> 2)];
        let voxel = old.map.voxel(node);
        theta += w * old.density[voxel];
        if voxel / BRICK_VOXELS != EMPTY_SLOT as usize {
            present += w;
            for (to, from) in colour.iter_mut().zip(&old.colour[voxel * stride..]) {
                *to += w * from;
            }
        }
    }
    if present > 0.0 {
        colour.iter_mut().for_each(|v| *v /= present);
    }
    theta
}
