//! Level sets from functions.

use rayon::prelude::*;
use refraxel_core::{Aabb, Domain, LevelSet, Vec3};

/// The level set with coefficients `phi(x)` at its nodes, on all threads.
pub(crate) fn level_set(
    bounds: Aabb<f32>,
    resolution: [u32; 3],
    phi: impl Fn(Vec3<f32>) -> f32 + Sync,
) -> LevelSet<f32> {
    let level = LevelSet::from_coefficients(bounds, resolution, at_nodes(bounds, resolution, phi));
    level.unwrap_or_else(|| unreachable!("distances are finite"))
}

/// The surface of a body that fills this share of the voxel of each node, 0 to 1: φ = (½ − share) · voxel, right up to half a voxel.
pub(crate) fn half_full(domain: &Domain<f32>, share: impl Fn(usize) -> f32) -> LevelSet<f32> {
    let nodes: usize = domain.resolution.map(|n| n as usize).iter().product();
    let phi = (0..nodes).map(|j| (0.5 - share(j)) * domain.voxel()).collect();
    let level = LevelSet::from_coefficients(domain.bounds, domain.resolution, phi);
    level.unwrap_or_else(|| unreachable!("shares are finite"))
}

/// `phi(x)` at the nodes of a grid, x fastest, on all threads.
pub(crate) fn at_nodes(
    bounds: Aabb<f32>,
    resolution: [u32; 3],
    phi: impl Fn(Vec3<f32>) -> f32 + Sync,
) -> Vec<f32> {
    let [nx, ny, nz] = resolution.map(|n| n as usize);
    let mut values = vec![0.0; nx * ny * nz];
    let cells = Vec3::from(resolution.map(|n| (n - 1) as f32));
    let step = bounds.extent().zip(cells, |e, n| e / n);
    values.par_chunks_exact_mut(nx).enumerate().for_each(|(row, out)| {
        for (i, value) in out.iter_mut().enumerate() {
            let node = Vec3::new(i as f32, (row % ny) as f32, (row / ny) as f32);
            *value = phi(bounds.min + node.hadamard(step));
        }
    });
    values
}
