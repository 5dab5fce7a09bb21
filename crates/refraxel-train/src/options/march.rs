//! How rays sample the radiance field.

use super::section::section;

section! {
    /// How rays sample the radiance field.
    pub struct MarchOptions "march" {
        /// Quadrature step during training [voxel].
        step: f32 = 1.0, in 0.05..=4.0, "voxels";
        /// Quadrature step of final renderings [voxel].
        render_step: f32 = 0.5, in 0.05..=4.0, "voxels";
        /// Rays begin at this share of the distance from the scene's centre to the nearest camera. Nothing nearer to a
        /// camera is seen.
        near: f32 = 0.2, in 0.0..=0.99;
        /// Rays stop at this transmittance.
        min_transmittance: f32 = 1e-3, in 0.0..=0.5;
    }
}
