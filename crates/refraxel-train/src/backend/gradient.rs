//! dLoss/d(everything) of a batch.

use super::outcome::StepOutcome;
use super::ray_gradient::RayGradient;
use crate::model::Mirror;
use refraxel_core::FieldGradient;
use refraxel_core::index::MediumGradient;
use refraxel_core::radiance::{ProbeGrid, clearcoat::ClearcoatGradient};

/// dLoss/d(everything) of a batch, for conformance tests and pose refinement.
#[derive(Clone, Debug)]
pub struct BatchGradient {
    /// With respect to the field's parameters.
    pub field: FieldGradient<f32>,
    /// With respect to the texels of an environment map; empty for a constant background.
    pub background: Vec<[f32; 3]>,
    /// With respect to the index and its surfaces; without blur and clip.
    pub medium: MediumGradient<f32>,
    /// With respect to the absorption coefficients [scene unit], per region; 0 where nothing absorbs and nothing learns to.
    pub absorption: Vec<[f64; 3]>,
    /// With respect to what surfaces mirror, per region.
    pub reflection: Vec<MirrorGradient>,
    /// With respect to the clearcoat of opaque things.
    pub clearcoat: Option<ClearcoatGradient<f32>>,
    /// With respect to each ray. What clearcoats of opaque things mirror is in it only in part.
    pub rays: Vec<RayGradient>,
    /// The outcome of the forward pass.
    pub outcome: StepOutcome,
}

/// dLoss/d(everything) of one mirror.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorGradient {
    /// With respect to its strength ρ.
    pub strength: f64,
    /// With respect to the coefficients of the outer cache.
    pub outer: Vec<f32>,
    /// With respect to the coefficients of the inner cache.
    pub inner: Vec<f32>,
}

impl MirrorGradient {
    /// No gradient yet.
    pub fn zero(mirror: &Mirror) -> Self {
        let zeros = |grid: &ProbeGrid<f32>| vec![0.0; grid.coefficients.len()];
        Self { strength: 0.0, outer: zeros(&mirror.outer), inner: zeros(&mirror.inner) }
    }

    /// Add another part of the same sum.
    pub fn merge(&mut self, other: &Self) {
        self.strength += other.strength;
        let pairs = self.outer.iter_mut().chain(&mut self.inner).zip(other.outer.iter().chain(&other.inner));
        pairs.for_each(|(a, b)| *a += b);
    }
}
