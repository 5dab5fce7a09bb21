//! The grid of the radiance field, and how it grows.

use super::Allowed;
use super::section::section;

section! {
    /// The grid of the radiance field, and how it grows during a run.
    pub struct GridOptions "grid" {
        /// Nodes along the longest edge of the final grid; 0: about one voxel per pixel, theory (4.10).
        resolution: u32 = 0, in Allowed::AutoOrWithin(8.0, 1024.0), "nodes";
        /// Largest resolution that is chosen automatically; 0: as many nodes as the rays of the run can teach, theory (4.10).
        max_resolution: u32 = 0, in Allowed::AutoOrWithin(16.0, 1024.0), "nodes";
        /// Number of coarse-to-fine stages, theory (4.9). Each doubles the resolution.
        stages: u32 = 3, in 1..=6;
        /// Voxels to which no training ray gives more weight than this are dropped between stages.
        prune_weight: f32 = 0.005, in 0.0..;
    }
}
