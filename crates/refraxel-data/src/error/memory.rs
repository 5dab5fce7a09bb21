//! What can be wrong with a dataset that is handed over in memory.

use crate::camera::CameraFault;
use crate::image::BadPixel;
use crate::pose::PoseFault;
use crate::size::Size;

/// Arrays in memory do not make a dataset. Views are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MemoryError {
    /// Too few views to reconstruct anything.
    #[error("{found} views in memory; at least 3 are needed, and some tens for a good result")]
    TooFewViews {
        /// How many views there are.
        found: usize,
    },
    /// One view cannot be used.
    #[error("view {index} ({name:?}): {fault}")]
    View {
        /// Which view.
        index: usize,
        /// Its name.
        name: String,
        /// What is wrong with it.
        fault: ViewFault,
    },
    /// Two views of one part of the split have one name.
    #[error("views {first} and {second} of the {part} split are both named {name:?}; give each its own name")]
    DuplicateName {
        /// `training`, `validation` or `test`.
        part: &'static str,
        /// The first of the two views.
        first: usize,
        /// The second.
        second: usize,
        /// Their name.
        name: String,
    },
    /// The split names a view that does not exist.
    #[error("the {part} split names view {index}; expected a number from 0 to {last}", last = count - 1)]
    NoSuchView {
        /// `training`, `validation` or `test`.
        part: &'static str,
        /// The number found.
        index: usize,
        /// How many views there are.
        count: usize,
    },
    /// A part of the split names one view twice.
    #[error("the {part} split names view {index} twice; name it once")]
    Repeated {
        /// `training`, `validation` or `test`.
        part: &'static str,
        /// The view.
        index: usize,
    },
    /// Nothing to learn from.
    #[error("the split has no training view; put at least one into `Split::train`")]
    NoTraining,
    /// All cameras coincide.
    #[error("all {count} views have the same pose, so nothing can be triangulated; check the poses")]
    SamePose {
        /// How many views there are.
        count: usize,
    },
    /// The backdrop is no colour.
    #[error("the backdrop has the colour {found:?}; expected red, green and blue from 0 to 1")]
    Backdrop {
        /// The colour found.
        found: [f32; 3],
    },
}

/// Why a view in memory cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewFault {
    /// The name cannot be that of a file.
    #[error("its name cannot be that of a file; expected a name without / and \\, which is not empty")]
    Name,
    /// The pose is not a rigid motion.
    #[error(transparent)]
    Pose(#[from] PoseFault),
    /// The camera can take no picture.
    #[error(transparent)]
    Camera(#[from] CameraFault),
    /// The image has no pixel.
    #[error("its image is {0}; expected at least one pixel")]
    NoPixels(Size),
    /// Image and camera differ in size.
    #[error("its image is {image}, but its camera is for {camera}; see `Camera::resized`")]
    ImageSize {
        /// Size of the image.
        image: Size,
        /// Size that the camera states.
        camera: Size,
    },
    /// The image is neither RGB nor RGBA.
    #[error("its image has {0} channels; expected 3 (RGB) or 4 (RGB and alpha)")]
    Channels(u32),
    /// The image has too few or too many values.
    #[error("its image has {found} values; expected height * width * channels = {expected}")]
    ImageValues {
        /// How many there are.
        found: usize,
        /// How many there must be.
        expected: u128,
    },
    /// A value of the image is not a colour.
    #[error("its image: {0}")]
    Pixel(BadPixel),
    /// Mask and image differ in size.
    #[error("its mask is {mask}, but its image is {image}; make the mask at the image's size")]
    MaskSize {
        /// Size of the mask.
        mask: Size,
        /// Size of the image.
        image: Size,
    },
    /// The mask has too few or too many values.
    #[error("its mask has {found} values; expected height * width = {expected}")]
    MaskValues {
        /// How many there are.
        found: usize,
        /// How many there must be.
        expected: u128,
    },
}
