//! A whole scene.

use super::{Reflection, Refraction};
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{Background, VoxelField};

/// Everything that rays can meet, in f32 and in the world coordinates of the user's data.
#[derive(Clone, Debug)]
pub struct Model {
    /// Density and colour on a sparse grid, theory (3.5)–(3.7).
    pub field: VoxelField<f32>,
    /// What rays see that leave the grid.
    pub background: Background<f32>,
    /// The index of refraction; without regions all rays are straight.
    pub refraction: Refraction,
    /// What refractive surfaces mirror.
    pub reflection: Reflection,
    /// What opaque things mirror, where they have a clearcoat.
    pub clearcoat: Option<Clearcoat<f32>>,
}

impl Model {
    /// A scene in which all rays are straight and nothing mirrors.
    pub fn straight(field: VoxelField<f32>, background: Background<f32>) -> Self {
        let (refraction, reflection) = (Refraction::none(), Reflection::none());
        Self { field, background, refraction, reflection, clearcoat: None }
    }
}
