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
    }
}
