//! The host values of a scene: what a checkpoint holds, a viewer draws and a backend loads.
//!
//! Nobody but a [backend](crate::backend) knows how a model is laid out in the memory of a device.

pub(crate) mod axis;
pub mod gate;
pub mod index_edit;
mod optimiser;
pub mod polyhedron;
pub mod reflection;
pub mod refraction;
mod resample;
pub mod surface;

pub use gate::Gate;
pub use optimiser::{AdamMoments, ClearcoatMoments, IndexMoments, MirrorMoments, Optimiser};
pub use reflection::{CacheId, Mirror, MirrorSource, PROBE_DEGREE, ProbeLayout, Reflection};
pub use refraction::{MAX_SEGMENTS, Optics, Refraction, RegionState};
pub use resample::resampled;

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
