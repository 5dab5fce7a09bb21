//! The grid around a refractive region.

use refraxel_core::index::BORDER;
use refraxel_core::{Aabb, Vec3};

/// How fine an index grid is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spacing {
    /// Edge length of a voxel [scene unit].
    Voxel(f32),
    /// Nodes along the longest edge, those around the box included.
    Longest(u32),
}

/// Layers of nodes between the box and the border of the grid, where the surface may grow; on the coarser grid where it
/// learns, at least one is left.
const ROOM: u32 = 6;
/// Layers of nodes around the box on each side.
const AROUND: u32 = BORDER as u32 + ROOM;
/// Most nodes along an axis: a voxel that is far too small must not exhaust the memory.
const MOST_NODES: u32 = 1024;

/// Bounds and resolution of an index grid with cubic voxels around a box: the box itself, 6 layers of nodes on each side
/// for the surface to move, and the 3 outermost that are held at n = 1. The box lies in the middle.
///
/// At least 20 and at most 1024 nodes along the longest edge: coarser or finer requests are brought into that range.
///
/// # Panics
/// If the box is empty, or a voxel is not positive.
pub fn region_grid(bounds: &Aabb<f32>, spacing: Spacing) -> (Aabb<f32>, [u32; 3]) {
    let extent = bounds.extent();
    let longest = extent.max_element();
    assert!(
        extent.min_element() >= 0.0 && longest > 0.0 && longest.is_finite(),
        "an empty box has no grid: {bounds:?}"
    );
    let cells = match spacing {
        Spacing::Voxel(voxel) => {
            assert!(voxel > 0.0, "a voxel of {voxel} scene units");
            (longest / voxel * (1.0 - 1e-5)).ceil()
        }
        Spacing::Longest(nodes) => nodes.saturating_sub(2 * AROUND + 1) as f32,
    };
    let cells = cells.clamp(1.0, (MOST_NODES - 2 * AROUND - 1) as f32);
    let voxel = match spacing {
        Spacing::Voxel(voxel) if (voxel * cells) >= longest * (1.0 - 2e-5) => voxel,
        _ => longest / cells,
    };
    let resolution =
        extent.to_array().map(|e| (e / voxel * (1.0 - 1e-5)).ceil().max(1.0) as u32 + 1 + 2 * AROUND);
    let half = Vec3::from(resolution.map(|n| 0.5 * voxel * (n - 1) as f32));
    (Aabb::new(bounds.center() - half, bounds.center() + half), resolution)
}

/// True when two boxes share more than a face.
pub(super) fn overlap(a: &Aabb<f32>, b: &Aabb<f32>) -> bool {
    (0..3).all(|k| a.min[k].max(b.min[k]) < a.max[k].min(b.max[k]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Domain, Extent, vec3};

    #[test]
    fn the_grid_has_cubic_voxels_and_room_around_the_box() {
        let inner = Aabb::new(vec3(-0.2, 0.1, 0.0), vec3(0.7, 0.6, 0.25));
        for spacing in [Spacing::Voxel(0.031), Spacing::Longest(61), Spacing::Longest(3), Spacing::Voxel(2.0)]
        {
            let (bounds, resolution) = region_grid(&inner, spacing);
            let domain = Domain { bounds, extent: Extent::Bounded, resolution };
            let edges = bounds.extent().zip(Vec3::from(resolution.map(|n| (n - 1) as f32)), |e, n| e / n);
            assert!(edges.max_element() - edges.min_element() < 1e-5, "{edges:?}");
            let (low, high) = (domain.node(inner.min), domain.node(inner.max));
            for a in 0..3 {
                assert!(low[a] >= 9.0 - 1e-3 && high[a] <= resolution[a] as f32 - 10.0 + 1e-3, "{spacing:?}");
            }
            match spacing {
                Spacing::Voxel(voxel) => assert!((domain.voxel() - voxel).abs() < 1e-5),
                Spacing::Longest(n) => assert_eq!(resolution[0], n.max(20)),
            }
        }
    }

    #[test]
    fn a_voxel_that_is_far_too_small_is_enlarged() {
        let inner = Aabb::new(Vec3::zero(), Vec3::splat(1.0));
        assert_eq!(region_grid(&inner, Spacing::Voxel(1e-9)).1, [1024; 3]);
    }
}
