//! The scene that is measured on.

use super::options::BenchGrid;
use crate::model::{Model, Refraction};
use rayon::prelude::*;
use refraxel_core::grid::{BRICK, BRICK_VOXELS};
use refraxel_core::sh::ShDegree;
use refraxel_core::{
    Aabb, Background, BrickMap, Domain, Extent, IndexGrid, LevelSet, Vec3, VoxelField, vec3,
};

/// The degree of its colours.
pub const DEGREE: u8 = 2;
/// Values that are set at a time.
const PART: usize = 1 << 16;
/// Radius of the shell of a sparse grid, and half its thickness [brick].
const SHELL: [f32; 2] = [44.0, 3.0];

/// A translucent box of smooth structure.
pub fn model(grid: BenchGrid) -> Model {
    let bounds = Aabb::cube(1.0);
    let domain = Domain::with_longest(bounds, Extent::Bounded, grid.nodes());
    let mut field =
        VoxelField::uniform(domain, map(grid), ShDegree::new(DEGREE).expect("2 is a degree"), -3.0);
    set(&mut field.density, |i| -3.0 + (i as f32 * 1e-3).sin());
    set(&mut field.colour, |i| 0.2 * (i as f32 * 0.37).sin());
    field.clear_empty_brick();
    Model::straight(field, Background::Constant([1.0; 3]))
}

/// Voxels that the scene stores.
pub fn voxels(grid: BenchGrid) -> usize {
    match grid {
        BenchGrid::Dense(nodes) => BRICK_VOXELS * (1 + (nodes.div_ceil(BRICK) as usize).pow(3)),
        BenchGrid::Sparse => map(grid).voxels(),
    }
}

fn map(grid: BenchGrid) -> BrickMap {
    let resolution = [grid.nodes(); 3];
    match grid {
        BenchGrid::Dense(_) => BrickMap::dense(resolution),
        BenchGrid::Sparse => shell(resolution),
    }
}

/// The bricks near a sphere around the middle.
fn shell(resolution: [u32; 3]) -> BrickMap {
    let middle = resolution.map(|n| 0.5 * n.div_ceil(BRICK) as f32);
    BrickMap::new(resolution, |brick| {
        let from_middle = |a: usize| brick[a] as f32 + 0.5 - middle[a];
        (vec3(from_middle(0), from_middle(1), from_middle(2)).length() - SHELL[0]).abs() < SHELL[1]
    })
}

fn set(values: &mut [f32], of: impl Fn(usize) -> f32 + Sync) {
    values.par_chunks_mut(PART).enumerate().for_each(|(k, part)| {
        part.iter_mut().enumerate().for_each(|(i, v)| *v = of(k * PART + i));
    });
}

/// A ball of glass of half the width of the box.
pub(super) fn ball() -> Refraction {
    let surface = LevelSet::from_samples(ball_bounds(), [BALL_NODES; 3], |x: Vec3<f32>| x.length() - 0.5);
    Refraction::of(vec![IndexGrid::sharp(surface, 1.5)])
}

/// Nodes per axis of the grid around the ball.
pub(super) const BALL_NODES: u32 = 64;

/// The box of that grid.
pub(super) fn ball_bounds() -> Aabb<f32> {
    Aabb::cube(0.6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sparse_grid_is_a_shell() {
        let share = voxels(BenchGrid::Sparse) as f64 / f64::from(BenchGrid::Sparse.nodes()).powi(3);
        // 4π · 44² · 6 bricks of 128³.
        assert!((share - 0.0696).abs() < 0.001, "{share}");
        let dense = BenchGrid::Dense(18);
        assert_eq!(voxels(dense), map(dense).voxels());
    }
}
