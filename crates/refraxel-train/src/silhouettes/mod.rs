//! Where a reconstruction of the refractive index starts: regions, shapes and fields.
//!
//! Silhouettes of the refractive objects become [`Outlines`]; those [locate](Outlines::locate) the regions and carve the
//! visual [`Hull`] of each. [`Site`] turns an occupancy, the truth, a volume or a mesh into an index grid.

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
pub use consistency::Consistency;
pub use fields::Site;
pub use hull::{Hull, Vote};
pub use locate::{LocateError, Search};
pub use occluders::{OPAQUE, Occluders, hidden_beyond};
pub(crate) use outline::Tangent;
pub use outline::{MAP_BYTES, Outlines, Silhouette};
pub use region::{Spacing, region_grid};
