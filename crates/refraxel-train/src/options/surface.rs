//! Sharp refractive surfaces: how they learn.

use super::section::section;

section! {
    /// Sharp refractive surfaces: how they learn.
    pub struct SurfaceOptions "surface" {
        /// Learning rate of a sharp surface [voxel of its grid]; 0 holds it fixed. Planes of a body with flat faces learn an eighth as fast.
        rate: f32 = 0.08, in 0.0..=1.0, "voxel";
        /// Standard deviation of the blur of its gradient [voxel of its grid].
        blur: f32 = 1.5, in 0.0..=8.0, "voxels";
        /// Smoothing of the surface per step; a surface that is held fixed is not smoothed.
        smooth: f32 = 0.1, in 0.0..=1.0;
        /// Weight of the depth at which rays beside a mask pass through a sharp surface [1 / voxel of its grid]: what is seen in the
        /// refraction may overrule masks.
        silhouette: f32 = 0.1, in 0.0..=10.0;
        /// Edge length of the voxels on which a surface learns, divided by that of the voxels on which it was found.
        coarsening: f32 = 1.4, in 1.0..=1.5;
        /// Surfaces learn only from rays that meet them at most this often.
        events: u32 = 2;
    }
}
