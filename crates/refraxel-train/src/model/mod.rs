//! The host values of a scene: what a checkpoint holds, a viewer draws and a backend loads.
//!
//! Nobody but a [backend](crate::backend) knows how a model is laid out in the memory of a device.

pub(crate) mod axis;
pub mod gate;
pub mod index_edit;
pub mod opaque;
mod optimiser;
pub mod polyhedron;
pub mod reflection;
pub mod refraction;
mod resample;
mod scene;
pub mod surface;

pub use gate::Gate;
pub use optimiser::{AdamMoments, ClearcoatMoments, IndexMoments, MirrorMoments, Optimiser};
pub use reflection::{CacheId, Mirror, MirrorSource, PROBE_DEGREE, ProbeLayout, Reflection};
pub use refraction::{MAX_SEGMENTS, Optics, Refraction, RegionState};
pub use resample::resampled;
pub use scene::Model;
