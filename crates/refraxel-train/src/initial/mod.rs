//! Where a reconstruction of the refractive index starts: regions, shapes and fields.
//!
//! Silhouettes of the refractive objects become [`Outlines`]; those [locate](Outlines::locate) the regions and carve the
//! visual [`Hull`] of each. [`Site`] turns an occupancy, the truth, a volume or a mesh into an index grid.

mod contour;
mod fields;
mod hull;
mod inside;
mod locate;
mod outline;
mod profile;
mod region;

pub use fields::Site;
pub use hull::{Hull, Vote};
pub use locate::{LocateError, Search};
pub use outline::{Outlines, Silhouette};
pub use profile::Profile;
pub use region::{Spacing, region_grid};
