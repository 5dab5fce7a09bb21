//! Posed photographs: importers, images, masks and splits, and a report of everything that looks wrong.
//!
//! [`Dataset::open`] reads a folder of any supported [`Format`], [`Dataset::in_memory`] takes arrays;
//! [`Dataset::load_photos`] gives the pixels of both. Every importer converts to the one camera frame of
//! [`refraxel_core::Camera`]; world coordinates are kept as they are, relative to an [`LocalOrigin`] near the scene where that is far
//! away. An [`IndexSource`] is a refractive index that is
//! known: the truth of a scene, a volume, or a mesh.

mod alpha;
mod assemble;
pub mod atomic;
mod backdrop;
mod bars;
mod below;
mod border;
mod bytes;
mod camera;
mod crop;
pub mod dataset;
mod decoding;
mod depth;
mod error;
mod extensions;
mod folder;
mod formats;
pub mod image;
pub mod index_source;
pub mod inspect;
mod jpeg;
mod json;
pub mod limits;
mod looks;
mod losses;
mod masks;
mod memory;
mod mesh_file;
mod naming;
mod open;
mod options;
mod orientation;
mod origin;
mod parsed;
mod part;
mod photo;
pub mod photographs;
mod pose;
mod profile;
mod quantize;
mod readings;
mod recentre;
mod reduce;
mod region;
mod repetitions;
mod rigid;
mod room;
mod root;
mod size;
mod split;
pub mod synth;
mod upright;
mod volume;
mod whole;

pub use alpha::NoAlphaMeaning;
pub use backdrop::NoBackdrop;
pub use camera::{CameraFault, is_one_place};
pub use crop::Crop;
pub use dataset::{
    AlphaMeaning, AlphaUse, Backdrop, Dataset, Format, MaskMeaning, NamedCamera, Photo, PhotoSource, Problem,
    Severity, Split, Stored, View,
};
pub use depth::{Depth, DepthFile};
pub use error::{DataError, MemoryError, ViewFault};
pub use formats::colmap::{ColmapModel, colmap_models};
pub use formats::ply::OPAQUE_REGION;
pub use image::{BadPixel, Image, Mask, Pixels, is_white};
pub use index_source::{IndexSource, IndexSourceError};
pub use inspect::{Inspection, report};
pub use jpeg::JpegFault;
pub use memory::PosedPhoto;
pub use mesh_file::read_mesh;
pub use naming::listed;
pub use open::open_cameras;
pub use options::OpenOptions;
pub use orientation::Orientation;
pub use origin::{LocalOrigin, Placed};
pub use part::Part;
pub use photo::{load_mask_of, load_photo, srgb_decode};
pub use pose::{PoseFault, quaternion_of_rotation};
pub use quantize::quantize;
pub use reduce::Reduction;
pub use region::{OutOfScale, Region, check_scale, quantile, scene_region, sees_box};
pub use size::Size;
pub use volume::{INDICES, IndexVolume};
