//! Where a reconstruction of the refractive index starts: regions, shapes and fields.
//!
//! Silhouettes of the refractive objects become [`Outlines`]; those [locate](Outlines::locate) the regions and carve the
//! visual hull of each. [`Site`] turns an occupancy, the truth, a volume or a mesh into an index grid.

#[cfg(test)]
pub(crate) mod around;
mod colours;
mod consistency;
mod contour;
mod fields;
mod hull;
mod inside;
mod locate;
mod occluders;
mod outline;
mod region;

pub use colours::{mean_colour, paint};
pub use fields::Site;
pub use hull::Vote;
pub use locate::{LocateError, Search};
pub use occluders::{OPAQUE, Occluders, hidden_beyond};
#[cfg(test)]
pub use outline::MAP_BYTES;
pub(crate) use outline::Tangent;
pub use outline::{Outlines, Silhouette};
pub use region::Spacing;
