//! What the user may decide about a dataset that is opened.

use crate::{AlphaMeaning, Backdrop, Crop, LocalOrigin, MaskMeaning, Orientation};
use refraxel_core::Vec3;

/// What the user may decide about a dataset that is opened.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OpenOptions {
    /// Hold out every n-th view (sorted by name, from the first) of datasets that state no split; 8 by
    /// default, 0 for none.
    pub holdout: Option<usize>,
    /// Allow files outside the dataset's folder (absolute paths, `..`, symbolic links).
    pub allow_outside: bool,
    /// What lies behind the scene, whatever the files say.
    pub backdrop: Option<Backdrop>,
    /// What the alpha channels of photographs mean, whatever they cover.
    pub alpha: Option<AlphaMeaning>,
    /// What the white of all masks means, whatever the files say.
    pub mask_meaning: Option<MaskMeaning>,
    /// Which pixels of photographs with an orientation tag (EXIF) the poses belong to, whatever the files say.
    pub orientation: Option<Orientation>,
    /// What is cut off all photographs and masks.
    pub crop: Crop,
    /// Which way is up, of any length above 0, whatever the cameras say.
    pub up: Option<Vec3<f64>>,
    /// The [origin](crate::Dataset::origin), such as that of a run on the same data; without one it is chosen.
    pub origin: Option<LocalOrigin>,
}
