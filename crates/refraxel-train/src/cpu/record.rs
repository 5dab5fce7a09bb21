//! What the way back leaves behind for the update: the adjoint of each sample, index sample and cache look-up.

use crate::model::CacheId;
use refraxel_core::Vec3;
use refraxel_core::grid::Cell;

/// The adjoint of one sample of the field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub cell: Cell,
    pub fraction: Vec3<f32>,
    /// Which of the tape's bases (directions of segments) coloured it; or [`DENSITY_GRADIENT`].
    pub basis: u32,
    /// dLoss/dθ at the sample; in the pass that looks for what to prune, the sample's weight T a instead.
    pub d_theta: f32,
    pub d_colour: [f32; 3],
}

/// The basis of a density-gradient record, whose `d_colour` is dLoss/d(∇θ) [1 / node].
pub(super) const DENSITY_GRADIENT: u32 = u32::MAX;

/// The adjoint of one index sample: an evaluation of the index, or of a surface, on a bent path.
#[derive(Clone, Copy, Debug)]
pub(super) struct IndexSample {
    pub region: u32,
    /// Of the level set φ; else of w.
    pub surface: bool,
    pub x: Vec3<f32>,
    /// dLoss/dvalue at x.
    pub d_value: f32,
    /// dLoss/dgradient at x.
    pub d_gradient: Vec3<f32>,
}

/// The adjoint of one look-up in a radiance cache.
#[derive(Clone, Copy, Debug)]
pub(super) struct CacheLookup {
    /// The region whose surface mirrors; or [`CLEARCOAT`].
    pub surface: u16,
    /// The cache that is read; without meaning for clearcoats.
    pub cache: CacheId,
    pub x: Vec3<f32>,
    pub direction: Vec3<f32>,
    pub d_radiance: [f32; 3],
    /// dLoss/d(strength of the mirror).
    pub d_strength: f32,
}

/// Stands for the region of what clearcoats mirror, which belongs to none.
pub(super) const CLEARCOAT: u16 = u16::MAX;
