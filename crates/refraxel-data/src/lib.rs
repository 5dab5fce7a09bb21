//! Posed photographs: importers, images, masks, splits and what is wrong with them.
//!
//! [`Dataset::open`] reads a folder of any supported [`Format`]; [`Dataset::load_photos`] decodes its images. Every
//! importer converts to the one camera frame of [`refraxel_core::Camera`]; world coordinates are kept as they are.

mod assemble;
mod bytes;
pub mod dataset;
mod error;
mod formats;
pub mod image;
mod index_source;
pub mod inspect;
mod json;
pub mod limits;
mod masks;
mod mesh_file;
mod open;
mod parsed;
mod photo;
mod pose;
mod region;
mod root;
mod split;
pub mod synth;
mod volume;

pub use dataset::{Backdrop, Dataset, Format, MaskMeaning, Photo, Problem, Severity, Split, View};
pub use error::{DataError, PoseFault, Size};
pub use image::{Image, Mask, Pixels};
pub use index_source::{IndexSource, IndexSourceError};
pub use inspect::{Inspection, report};
pub use mesh_file::read_mesh;
pub use open::{NamedCamera, OpenOptions, open_cameras};
pub use photo::load_photo;
pub use region::{Region, scene_region};
pub use volume::IndexVolume;
