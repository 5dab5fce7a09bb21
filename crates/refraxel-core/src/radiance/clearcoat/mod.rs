//! The light that opaque objects under a clearcoat mirror, theory (7.13)–(7.16).
//!
//! A voxel field has no surfaces, but the density rises steeply where an opaque object begins: the mean of the density
//! gradient over the samples that a ray sees is the normal there ([`Facing`]). One cache look-up along the mirrored ray
//! gives all the light that the clearcoat reflects. [`ClearcoatedScene`] is the readable reference for fast backends.

mod coat;
mod facing;
mod shown;

#[cfg(test)]
mod tests;

pub use coat::{Clearcoat, ClearcoatGradient};
pub use facing::{ClearcoatReflection, Facing, FacingAdjoint, LEAST_COSINE, LEAST_SLOPE};
pub use shown::ClearcoatedScene;
