//! Whether something says what is refractive, found out before training.

use super::context::SearchError;
use crate::options::{Options, StartShape, Switch};
use refraxel_data::{Dataset, IndexSource, MaskMeaning};

/// Finds out before training whether something says what is refractive; `masked`: the dataset has masks of it.
pub fn check(options: &Options, masked: bool, index: Option<&IndexSource>) -> Result<(), SearchError> {
    if options.refraction.bend == Switch::Off {
        return Ok(());
    }
    if options.shape.start == StartShape::File && index.is_none() {
        return Err(SearchError::NoFile);
    }
    let named = index.is_some() || options.refraction.stated_box().is_some();
    let seeks = options.detection.enabled.is_on() && options.shape.start == StartShape::Hull;
    if named || masked || seeks { Ok(()) } else { Err(SearchError::Nowhere) }
}

/// Whether a file of the index or a mask says what is refractive.
pub fn is_told(has_index: bool, data: &Dataset) -> bool {
    has_index || has_masks(data)
}

/// Whether some training view has a mask of what is refractive.
pub fn has_masks(data: &Dataset) -> bool {
    let mut views = data.split.train.iter().map(|&i| &data.views[i]);
    views.any(|v| v.has_mask() && v.mask_meaning == MaskMeaning::Refractive)
}
