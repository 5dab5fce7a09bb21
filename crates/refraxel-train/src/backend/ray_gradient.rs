//! dLoss/d(one ray), and dLoss/d(what it shows).

use refraxel_core::Vec3;

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
