//! What can be wrong with a dataset, its files included.

use super::memory::MemoryError;
use crate::Crop;
use crate::camera::CameraFault;
use crate::image::BadPixel;
use crate::jpeg::JpegFault;
use crate::pose::PoseFault;
use crate::size::Size;
use std::path::PathBuf;

/// A dataset or one of its files cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DataError {
    /// The path does not exist.
    #[error("{path}: no such file or folder; check the spelling, or give the folder that holds the dataset", path = path.display())]
    NotFound {
        /// The path that was given.
        path: PathBuf,
    },
    /// The operating system refused to read a file.
    #[error("{path}: cannot be read: {source}", path = path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// There is no dataset of a known format.
    #[error(
        "{path}: no dataset found; expected transforms.json, transforms_train.json (Blender), a COLMAP model \
         (cameras and images as .bin or .txt in sparse/0, colmap/sparse/0, sparse or here), poses_bounds.npy (LLFF), \
         pose/ with intrinsics.txt (NSVF), reconstruction.json (OpenSfM, OpenDroneMap), cameras as .xml (Metashape), \
         camera parameters as .csv (RealityCapture, RealityScan), metadata with rgb/ (Record3D), keyframes/ (Polycam), \
         or cameras.json (3D Gaussian Splatting), here or in one folder below",
        path = path.display()
    )]
    UnknownFormat {
        /// The folder or file.
        path: PathBuf,
    },
    /// Several datasets, or several files that describe one, of which none is the one that is meant.
    #[error(
        "{path}: several datasets found: {}; give one of them",
        found.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", "),
        path = path.display()
    )]
    SeveralDatasets {
        /// The folder that was given.
        path: PathBuf,
        /// What was found in it.
        found: Vec<PathBuf>,
    },
    /// A packed file.
    #[error(
        "{path}: an archive, which is not read; unpack it, for example by `{command}`, and give the folder that comes out",
        path = path.display()
    )]
    Archive {
        /// The file.
        path: PathBuf,
        /// A command that unpacks it.
        command: String,
    },
    /// A part of a dataset, such as its folder of photographs.
    #[error("{path}: a part of the dataset in {dataset}; give that folder", path = path.display(), dataset = dataset.display())]
    Part {
        /// The folder or file.
        path: PathBuf,
        /// The folder of the dataset.
        dataset: PathBuf,
    },
    /// Photographs that no file gives poses to.
    #[error("{path}: {count} photographs without poses; their poses have to be computed first", path = path.display())]
    NoPoses {
        /// The folder.
        path: PathBuf,
        /// How many photographs it holds.
        count: usize,
    },
    /// A video, of which photographs have to be taken.
    #[error("{path}: a video, which has no poses; photographs have to be taken from it and posed first", path = path.display())]
    Video {
        /// The file.
        path: PathBuf,
    },
    /// A file or count is beyond the limit that protects memory.
    #[error("{path}: {what} is {found}, the limit is {limit}; split or shrink the data", path = path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// What is too large, with its unit.
        what: &'static str,
        /// Its size.
        found: u64,
        /// The largest size accepted.
        limit: u64,
    },
    /// The file is not JSON.
    #[error("{path}: not valid JSON: {source}", path = path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        source: serde_json::Error,
    },
    /// The file is not XML.
    #[error("{path}: not valid XML: {source}", path = path.display())]
    Xml {
        /// The file.
        path: PathBuf,
        /// Line, column and reason.
        source: Box<roxmltree::Error>,
    },
    /// A key or field is missing or has an impossible value.
    #[error("{path}: {key} is {found}; expected {expected}", path = path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// The key (`frames[3].fl_x`), line (`line 12`) or field.
        key: String,
        /// What stands there, shortened.
        found: String,
        /// What must stand there.
        expected: &'static str,
    },
    /// A binary or text file ends early or contradicts itself.
    #[error("{path}: damaged at {at}: found {found}; expected {expected}; copy or export the file again", path = path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Byte offset or line.
        at: String,
        /// What was found.
        found: String,
        /// What was expected.
        expected: &'static str,
    },
    /// A mesh is none.
    #[error("{path}: {source}; export the mesh again", path = path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: crate::synth::MeshError,
    },
    /// A camera model that cannot be traced.
    #[error(
        "{path}: {key}: unsupported camera model {model}; supported are SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL, \
         OPENCV, FULL_OPENCV, OPENCV_FISHEYE, SIMPLE_RADIAL_FISHEYE, RADIAL_FISHEYE, SIMPLE_FISHEYE, FISHEYE, FOV, \
         THIN_PRISM_FISHEYE and EQUIRECTANGULAR; calibrate again with one of them",
        path = path.display()
    )]
    UnsupportedCamera {
        /// The file.
        path: PathBuf,
        /// Key or line.
        key: String,
        /// The model's name or number.
        model: String,
    },
    /// A feature of the format that would silently give wrong rays.
    #[error("{path}: {key} is not supported: {advice}", path = path.display())]
    UnsupportedFeature {
        /// The file.
        path: PathBuf,
        /// The key.
        key: String,
        /// Why, and what to do.
        advice: &'static str,
    },
    /// A path in the dataset leads out of it.
    #[error(
        "{path}: {key} names {found:?}, which leads outside the dataset folder; move the file inside, or allow outside \
         files (--allow-outside) if you trust this dataset",
        path = path.display()
    )]
    OutsideRoot {
        /// The file that names the path.
        path: PathBuf,
        /// The key or line.
        key: String,
        /// The path as stated.
        found: String,
    },
    /// None of the images exists.
    #[error(
        "{path}: none of the {count} images it names exists; the first is {first:?}; {there}; else put the images beside \
         the file or correct the names",
        path = path.display()
    )]
    AllImagesMissing {
        /// The file that names the images.
        path: PathBuf,
        /// How many it names.
        count: usize,
        /// The first of them.
        first: String,
        /// What lies where it should be.
        there: String,
    },
    /// So many views cannot be used that the files must be wrong.
    #[error(
        "{path}: {lost} of {count} views cannot be used: {reasons}; add what is missing, or take these views out of the files",
        path = path.display()
    )]
    ViewsLost {
        /// The dataset.
        path: PathBuf,
        /// How many views its files have.
        count: usize,
        /// How many of them cannot be used.
        lost: usize,
        /// Why, and which they are.
        reasons: String,
    },
    /// A file names no camera.
    #[error("{path}: it names no cameras; expected at least one frame", path = path.display())]
    NoCameras {
        /// The file.
        path: PathBuf,
    },
    /// Too few views to reconstruct anything.
    #[error("{path}: {found} usable views; at least 3 are needed, and some tens for a good result", path = path.display())]
    TooFewViews {
        /// The dataset.
        path: PathBuf,
        /// How many views are left.
        found: usize,
    },
    /// A camera pose is not a rigid motion.
    #[error("{path}: {key}: {fault}; export the poses again", path = path.display())]
    Pose {
        /// The file.
        path: PathBuf,
        /// Frame or line.
        key: String,
        /// What is wrong.
        fault: PoseFault,
    },
    /// A camera can take no picture.
    #[error("{path}: {key}: {fault}; calibrate or export the camera again", path = path.display())]
    Camera {
        /// The file.
        path: PathBuf,
        /// Frame or line.
        key: String,
        /// What is wrong.
        fault: CameraFault,
    },
    /// No view trains.
    #[error("{path}: none of the {count} views trains ({rule}); name some for training, or leave the split out", path = path.display())]
    NoTraining {
        /// The dataset.
        path: PathBuf,
        /// How many views there are.
        count: usize,
        /// The rule of the split.
        rule: String,
    },
    /// All cameras coincide.
    #[error(
        "{path}: all {count} views have the same pose, so nothing can be triangulated; check that the poses were exported",
        path = path.display()
    )]
    SamePose {
        /// The dataset.
        path: PathBuf,
        /// Number of views.
        count: usize,
    },
    /// One image is listed twice in one split.
    #[error("{path}: {key} names the image {image} again; remove the duplicate frame", path = path.display(), image = image.display())]
    DuplicateFrame {
        /// The file.
        path: PathBuf,
        /// The second frame.
        key: String,
        /// The image.
        image: PathBuf,
    },
    /// A picture in a format that is not read.
    #[error("{path}: pictures of this format are not read; convert it, for example by `{command}`, and name the result where this one \
        is named", path = path.display())]
    Unread {
        /// The image.
        path: PathBuf,
        /// A command that converts it.
        command: String,
    },
    /// A picture without a second column or row.
    #[error("{path}: the image is {found}; expected at least 2 columns and 2 rows", path = path.display())]
    ImageTooSmall {
        /// The image.
        path: PathBuf,
        /// Its size.
        found: Size,
    },
    /// An image or mask does not decode.
    #[error(
        "{path}: cannot decode this image: {reason}; export it again as PNG or JPEG",
        path = path.display(),
        reason = source.to_string().trim_end()
    )]
    Decode {
        /// The file.
        path: PathBuf,
        /// The decoder's reason.
        source: image::ImageError,
    },
    /// A compressed depth map is not of the size that its description states.
    #[error(
        "{path}: {found} bytes of depth; expected {expected}, 4 for each pixel of {size} (`dw` and `dh` of the metadata); export the \
         recording again, or remove its depth maps",
        path = path.display()
    )]
    Record3dDepth {
        /// The depth map.
        path: PathBuf,
        /// How many bytes it holds.
        found: String,
        /// How many bytes a map of this size has.
        expected: u64,
        /// The size that the description states.
        size: Size,
    },
    /// The image changed size since the dataset was opened.
    #[error("{path}: the image is {found}, but its camera was read for {expected}; open the dataset again", path = path.display())]
    ImageSize {
        /// The image.
        path: PathBuf,
        /// Its size now.
        found: Size,
        /// The camera's size.
        expected: Size,
    },
    /// Too little of a photograph is left.
    #[error(
        "{crop} is to be cut off {name} (left, top, right, bottom), which is {size}; expected at least 8 columns and rows to stay"
    )]
    Crop {
        /// What is to be cut off.
        crop: Crop,
        /// The photograph.
        name: String,
        /// Its size.
        size: Size,
    },
    /// Mask and image differ in size.
    #[error("{path}: the mask is {mask}, but its image {image} is {expected}; make the mask at the image's size", path = path.display(), image = image.display())]
    MaskSize {
        /// The mask.
        path: PathBuf,
        /// Its size.
        mask: Size,
        /// The image.
        image: PathBuf,
        /// The image's size.
        expected: Size,
    },
    /// A pixel has no colour.
    #[error("{path}: {pixel}; repair it before training", path = path.display())]
    Pixel {
        /// The image.
        path: PathBuf,
        /// The first such pixel.
        pixel: BadPixel,
    },
    /// A JPEG whose pixels are not all there: decoders fill the rest with grey.
    #[error("{path}: damaged: {fault}; copy or export the image again", path = path.display())]
    Jpeg {
        /// The image.
        path: PathBuf,
        /// What is wrong with it.
        fault: JpegFault,
    },
    /// Arrays in memory do not make a dataset.
    #[error(transparent)]
    Memory(#[from] MemoryError),
}
