//! Posed photographs: importers, images, masks and splits, and a report of everything that looks wrong.
//!
//! [`Dataset::open`] reads a folder of any supported [`Format`], [`Dataset::in_memory`] takes arrays;
//! [`Dataset::load_photos`] gives the pixels of both. Every importer converts to the one camera frame of
//! [`refraxel_core::Camera`]; world coordinates are kept as they are. An [`IndexSource`] is a refractive index that is
//! known: the truth of a scene, a volume, or a mesh.

mod assemble;
mod border;
mod bytes;
mod camera;
mod crop;
pub mod dataset;
mod error;
mod formats;
pub mod image;
pub mod index_source;
pub mod inspect;
mod jpeg;
mod json;
pub mod limits;
mod masks;
mod memory;
mod mesh_file;
mod open;
mod options;
mod parsed;
mod photo;
pub mod photographs;
mod pose;
mod reduce;
mod region;
mod root;
mod size;
mod split;
pub mod synth;
mod volume;

pub use camera::{CameraFault, is_one_place};
pub use crop::Crop;
pub use dataset::{
    Backdrop, Dataset, Format, MaskMeaning, NamedCamera, Photo, PhotoSource, Problem, Severity, Split,
    Stored, View,
};
pub use error::{DataError, MemoryError, ViewFault};
pub use formats::colmap::{ColmapModel, colmap_models};
pub use image::{BadPixel, Image, Mask, Pixels};
pub use index_source::{INDICES, IndexSource, IndexSourceError};
pub use inspect::{Inspection, report};
pub use jpeg::JpegFault;
pub use memory::PosedPhoto;
pub use mesh_file::read_mesh;
pub use open::open_cameras;
pub use options::OpenOptions;
pub use photo::{load_mask_of, load_photo};
pub use pose::PoseFault;
pub use reduce::Reduction;
pub use region::{OutOfScale, Region, check_scale, scene_region};
pub use size::Size;
pub use volume::IndexVolume;
