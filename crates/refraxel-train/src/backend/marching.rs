//! How rays are marched.

use refraxel_core::VoxelField;

/// How densely and how far rays are marched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marching {
    /// Quadrature step [voxel].
    pub step: f32,
    /// Nothing nearer to the camera than this is seen [scene unit].
    pub near: f32,
    /// Samples of smaller optical depth per voxel count as perfectly transparent and get no gradient.
    pub min_optical_depth: f32,
    /// A ray ends once its transmittance falls below this.
    pub min_transmittance: f32,
}

impl Marching {
    /// No cut-offs: every sample inside the grid is evaluated. For tests and benchmarks.
    pub fn exhaustive(step: f32) -> Self {
        Self { step, near: 0.0, min_optical_depth: 0.0, min_transmittance: 0.0 }
    }

    /// Raw density θ [1] at which the optical depth of a voxel reaches the cut-off: softplus⁻¹. Outside the box of a contracted
    /// domain steps and voxels grow together, so one threshold serves.
    #[inline(always)]
    pub fn theta_min(&self, field: &VoxelField<f32>) -> f32 {
        let cut = self.min_optical_depth / (field.density_scale() * field.domain.voxel());
        if cut > 0.0 { cut.exp_m1().ln() } else { f32::NEG_INFINITY }
    }
}
