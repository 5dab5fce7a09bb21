//! What goes into a step: rays with the colours that they should show, and how rays are marched.

use refraxel_core::{Ray, Vec3, VoxelField};

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

/// Rays with the colours that they should show.
#[derive(Clone, Debug, Default)]
pub struct Batch {
    /// Rays in world coordinates.
    pub rays: Vec<Ray<f32>>,
    /// Observed colour per ray (sRGB-encoded).
    pub target: Vec<[f32; 3]>,
    /// Radiance behind the field per ray; empty: the model's own background.
    pub behind: Vec<[f32; 3]>,
    /// Shift of the quadrature points per ray, in [0, 1) steps.
    pub offset: Vec<f32>,
    /// Whether each ray's pixel lies beside the mask of what is refractive of its view; empty: nobody knows.
    pub beside: Vec<bool>,
}

impl Batch {
    /// Whether a ray is known to pass beside what is refractive.
    #[inline(always)]
    pub fn is_beside(&self, ray: usize) -> bool {
        self.beside.get(ray) == Some(&true)
    }

    /// The first `most` rays that are `chosen`.
    #[must_use]
    pub fn filtered(&self, most: usize, chosen: impl Fn(&Ray<f32>) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.rays.len()).filter(|&k| chosen(&self.rays[k])).take(most).collect();
        Self {
            rays: kept.iter().map(|&k| self.rays[k]).collect(),
            target: kept.iter().map(|&k| self.target[k]).collect(),
            behind: kept.iter().filter_map(|&k| self.behind.get(k).copied()).collect(),
            offset: kept.iter().map(|&k| self.offset[k]).collect(),
            beside: kept.iter().filter_map(|&k| self.beside.get(k).copied()).collect(),
        }
    }

    /// The rays of both, these first.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.rays.extend(other.rays);
        self.target.extend(other.target);
        self.behind.extend(other.behind);
        self.offset.extend(other.offset);
        self.beside.extend(other.beside);
        self
    }
}

/// dLoss/d(what a ray shows) of any loss: the input of a vector–Jacobian product.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelGradient {
    /// With respect to its colour over the background (sRGB-encoded, 1 = white).
    pub colour: [f32; 3],
    /// With respect to its transmittance, beyond what the background explains.
    pub transmittance: f32,
}

/// What a ray shows beside its target, and dLoss/d(origin, direction).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayGradient {
    /// With respect to the origin [1 / scene unit].
    pub origin: Vec3<f32>,
    /// With respect to the unit direction.
    pub direction: Vec3<f32>,
    /// C − target.
    pub residual: [f32; 3],
}

impl RayGradient {
    /// No gradient.
    pub fn zero() -> Self {
        Self { origin: Vec3::zero(), direction: Vec3::zero(), residual: [0.0; 3] }
    }
}
