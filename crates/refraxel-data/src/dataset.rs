//! What every importer produces: posed views, their split, and what is known or wrong about them.

use crate::image::{Image, Mask};
use refraxel_core::{Aabb, Camera, Vec3};
use std::path::PathBuf;

/// A set of posed photographs in the world coordinates of the user's data.
#[derive(Clone, Debug)]
pub struct Dataset {
    /// Folder (or file) that was opened.
    pub root: PathBuf,
    /// Which importer read it.
    pub format: Format,
    /// All views of all splits, in file order.
    pub views: Vec<View>,
    /// Which views train, validate and test.
    pub split: Split,
    /// What lies behind the scene, as far as the data says.
    pub backdrop: Backdrop,
    /// Region of interest, where the dataset states one.
    pub stated_box: Option<Aabb<f64>>,
    /// Sparse points of the reconstruction that posed the cameras; may be empty.
    pub points: Vec<Vec3<f64>>,
    /// Nearest and farthest depth of the scene [scene unit], where the dataset states them (LLFF).
    pub depth_range: Option<[f64; 2]>,
    /// Truth about refractive objects (`scene.json`), where it comes with the data.
    pub truth: Option<serde_json::Value>,
    /// Everything that was repaired, left out or looks wrong, in the order found.
    pub problems: Vec<Problem>,
}

/// One posed photograph.
#[derive(Clone, Debug)]
pub struct View {
    /// File name of the image with its extension, e.g. `r_0.png`; unique within a split.
    pub name: String,
    /// The image file.
    pub image: PathBuf,
    /// The mask file, where there is one.
    pub mask: Option<PathBuf>,
    /// What the mask's white means.
    pub mask_meaning: MaskMeaning,
    /// Pose, intrinsics and lens.
    pub camera: Camera,
}

/// A view's decoded pixels.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Colour and, where the file has it, alpha.
    pub image: Image,
    /// Mask as in the file; see [`View::mask_meaning`].
    pub mask: Option<Mask>,
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
    /// The rule that made the split, for people.
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

/// What lies behind everything else.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Backdrop {
    /// Images carry alpha: nothing is behind the object, any colour may be put there.
    Transparent,
    /// One known sRGB colour.
    Color([f32; 3]),
    /// A real, unbounded surrounding to be learned.
    Surroundings,
}

/// The file format of a dataset.
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
