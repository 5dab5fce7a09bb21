//! COLMAP sparse models, binary or text: `cameras`, `images` and `points3D`.
//!
//! Image poses are world-to-camera with OpenCV axes; pixel centres are at +0.5, as inside.

mod binary;
mod files;
mod models;
mod read;
mod records;
mod sightings;
mod summary;
mod text;

pub(crate) use files::{find_models, half_model};
pub(crate) use read::read;
pub(crate) use sightings::sightings;
pub use summary::{ColmapModel, colmap_models};
