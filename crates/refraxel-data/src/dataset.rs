//! Posed views, their split, and what is known or wrong about them: the same whether they come from files or from
//! memory.

use crate::image::{Image, Mask};
use crate::orientation::Orientation;
use crate::origin::LocalOrigin;
use crate::synth::IndexTruth;
use crate::{Crop, Depth, DepthFile};
use refraxel_core::{Aabb, Camera, Vec3};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::sync::Arc;

/// A set of posed photographs in the coordinates of the user's data, relative to [`Dataset::origin`].
///
/// [`Dataset::open`] reads one from files, [`Dataset::in_memory`] makes one of arrays.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// The dataset's folder; `None` for a dataset in memory.
    pub root: Option<PathBuf>,
    /// The format of the files, or [`Format::Memory`].
    pub format: Format,
    /// Where the coordinates of cameras, box and points begin: that of the user's world, unless the scene is far from it.
    pub origin: LocalOrigin,
    /// All views of all splits, in file order.
    pub views: Vec<View>,
    /// Which views train, validate and test.
    pub split: Split,
    /// What lies behind the scene, as far as the data says.
    pub backdrop: Backdrop,
    /// Region of interest, where the dataset states one.
    pub stated_box: Option<Aabb<f64>>,
    /// Unit vector upwards, where somebody says it; otherwise the cameras do.
    pub up: Option<Vec3<f64>>,
    /// Sparse points of the reconstruction that posed the cameras; may be empty.
    pub points: Vec<Vec3<f64>>,
    /// Nearest and farthest depth of the scene [scene unit], where the dataset states them (LLFF).
    pub depth_range: Option<[f64; 2]>,
    /// Truth about refractive objects (`scene.json`), where it comes with the data, in the coordinates of the user's world. What
    /// it says of the index is given by [`Dataset::index_truth`].
    pub truth: Option<serde_json::Value>,
    /// Everything that was repaired, left out or looks wrong, in the order found.
    pub problems: Vec<Problem>,
}

impl Dataset {
    /// The index of refraction that [`Dataset::truth`] states, where it does, relative to [`Dataset::origin`].
    pub fn index_truth(&self) -> Option<IndexTruth> {
        Some(self.origin.to_local(IndexTruth::from_scene_json(self.truth.as_ref()?)?))
    }
}

/// One posed photograph.
#[derive(Clone, Debug)]
pub struct View {
    /// The file name of the image with its extension, e.g. `r_0.png`, or any name that a file can have. It is unique
    /// within a part of the split.
    pub name: String,
    /// Where the image and the mask are.
    pub source: PhotoSource,
    /// What the mask's white means.
    pub mask_meaning: MaskMeaning,
    /// Pose, intrinsics and lens.
    pub camera: Camera,
    /// Its depth map, where one lies beside its files.
    pub depth: Option<DepthFile>,
}

/// Where the pixels of a view are. [`load_photo`](crate::load_photo) gives them for both.
#[derive(Clone, Debug)]
pub enum PhotoSource {
    /// In files, which are decoded anew each time.
    Files {
        /// The image.
        image: PathBuf,
        /// The mask, where there is one; the image itself where its alpha channel is the mask.
        mask: Option<PathBuf>,
        /// How they lie in the files, where the view [has fewer](Dataset::reduce) or is cut.
        stored: Option<Stored>,
        /// Which of their pixels are meant, where the image has an orientation tag (EXIF).
        orientation: Orientation,
        /// What becomes of the image's alpha channel.
        alpha: AlphaUse,
    },
    /// In memory.
    Memory(Photo),
}

/// What becomes of the alpha channel of an image file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaUse {
    /// It says where nothing is before the backdrop.
    #[default]
    Kept,
    /// Colours count as they are stored.
    LeftOut,
    /// The image is laid over this sRGB colour.
    Over([f32; 3]),
}

/// How the pixels of a view lie in its files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stored {
    /// Width and height of the files [pixel].
    pub size: [u32; 2],
    /// What is cut off them, before anything else.
    pub crop: Crop,
}

impl View {
    /// A view of an image file without a mask, turned upright; it is named by its file.
    pub fn of_file(image: impl Into<PathBuf>, camera: Camera) -> Self {
        let image = image.into();
        let name = image.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let source = PhotoSource::Files {
            image,
            mask: None,
            stored: None,
            orientation: Orientation::Upright,
            alpha: AlphaUse::Kept,
        };
        Self { name, source, mask_meaning: MaskMeaning::Keep, camera, depth: None }
    }

    /// True where the view has a mask.
    pub fn has_mask(&self) -> bool {
        match &self.source {
            PhotoSource::Files { mask, .. } => mask.is_some(),
            PhotoSource::Memory(photo) => photo.mask.is_some(),
        }
    }
}

/// The pixels of a view. A clone shares them.
#[derive(Clone, Debug, PartialEq)]
pub struct Photo {
    /// Colour and, where there is one, alpha.
    pub image: Arc<Image>,
    /// The mask as it was stated; [`View::mask_meaning`] says what its white means.
    pub mask: Option<Arc<Mask>>,
    /// How far away what it shows is, as far as that was measured.
    pub depth: Option<Arc<Depth>>,
}

impl Photo {
    /// A photo of pixels in memory. Nothing is checked before [`Dataset::in_memory`].
    pub fn new(image: Image, mask: Option<Mask>) -> Self {
        Self { image: Arc::new(image), mask: mask.map(Arc::new), depth: None }
    }
}

/// A posed camera and the name of its picture without folder or extension.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCamera {
    /// The stem of the picture's file; with its folders where two pictures share a stem.
    pub name: String,
    /// Pose, intrinsics and lens.
    pub camera: Camera,
}

/// Indices into [`Dataset::views`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Split {
    /// Views to learn from.
    pub train: Vec<usize>,
    /// Views for tuning; may be empty.
    pub val: Vec<usize>,
    /// Held-out views.
    pub test: Vec<usize>,
    /// The rule that made the split, for people. [`Dataset::in_memory`] replaces an empty one by "as given".
    pub rule: String,
}

/// What the white of a mask means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaskMeaning {
    /// White = the refractive object is the first thing hit.
    Refractive,
    /// White = use this pixel, black = ignore it.
    Keep,
    /// White = ignore this pixel.
    Ignore,
}

impl MaskMeaning {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Refractive, Self::Keep, Self::Ignore];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Refractive => "refractive",
            Self::Keep => "keep",
            Self::Ignore => "ignore",
        }
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|meaning| meaning.name() == name)
    }
}

/// What the alpha channels of photographs mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AlphaMeaning {
    /// Nothing is behind what alpha covers: a thing that was cut out.
    Backdrop,
    /// Alpha is a mask of a whole photograph.
    Mask,
    /// Nothing.
    Ignore,
}

/// What lies behind everything else.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Backdrop {
    /// Images carry alpha: nothing is behind the object, any colour may be put there.
    Transparent,
    /// One known sRGB colour.
    Color([f32; 3]),
    /// A real, unbounded surrounding to be learned.
    Surroundings,
}

/// Where a dataset comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `transforms_{train,val,test}.json` of NeRF-synthetic.
    Blender,
    /// One `transforms.json` of nerfstudio or instant-ngp.
    Transforms,
    /// COLMAP `cameras`, `images`, `points3D` as `.bin` or `.txt`.
    Colmap,
    /// LLFF `poses_bounds.npy`.
    Llff,
    /// NSVF `pose/`, `rgb/`, `intrinsics.txt`.
    Nsvf,
    /// OpenSfM `reconstruction.json`, which OpenDroneMap writes too.
    OpenSfm,
    /// Cameras of Agisoft Metashape as XML.
    Metashape,
    /// Internal and external camera parameters of RealityCapture or RealityScan as CSV.
    RealityCapture,
    /// Record3D `metadata` with `rgb/` or `rgbd/`.
    Record3d,
    /// Polycam's raw data, `keyframes/`.
    Polycam,
    /// `cameras.json` of 3D Gaussian Splatting.
    GaussianSplatting,
    /// Arrays in memory.
    Memory,
}

/// Something that was repaired, left out, or that the user should know.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// How bad it is.
    pub severity: Severity,
    /// One sentence: where, what was found, what was done, what to do.
    pub message: String,
}

/// How bad a [`Problem`] is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// Probably lowers quality.
    Warning,
}

impl Problem {
    /// Something worth knowing.
    pub fn note(message: impl Into<String>) -> Self {
        Self { severity: Severity::Note, message: message.into() }
    }

    /// Something that probably lowers quality.
    pub fn warning(message: impl Into<String>) -> Self {
        Self { severity: Severity::Warning, message: message.into() }
    }
}
