//! Masks that the dataset has already.

use crate::exit::{Exit, Failure};
use crate::verbs::dataset::data_failure;
use crate::verbs::files::absolute;
use refraxel_data::{Dataset, Mask, MaskMeaning, PhotoSource, View, load_mask_of};
use std::path::Path;
use std::sync::Arc;

/// Masks in the folder are made anew.
pub(super) fn forget(data: &mut Dataset, out: &Path) {
    let out = absolute(out);
    for view in &mut data.views {
        if let PhotoSource::Files { mask, .. } = &mut view.source {
            mask.take_if(|mask| absolute(mask).starts_with(&out));
        }
    }
}

/// Refuses data whose masks say which pixels to use: masks of glass would take their place.
pub(super) fn refuse_other_masks(data: &Dataset) -> Result<(), Failure> {
    let other = data.views.iter().find(|v| v.has_mask() && v.mask_meaning != MaskMeaning::Refractive);
    let Some(view) = other else { return Ok(()) };
    Err(Exit::BadInput.because(format!(
        "the mask of {} is taken to say which pixels to use, and a photograph has one mask; if its white means glass, say \
         --mask-meaning refractive, else remove these masks",
        view.name
    )))
}

/// Refuses data in which nothing is to be found.
pub(super) fn refuse_complete(data: &Dataset) -> Result<(), Failure> {
    let is_masked =
        |v: &usize| data.views[*v].has_mask() && data.views[*v].mask_meaning == MaskMeaning::Refractive;
    if !data.split.train.iter().all(is_masked) {
        return Ok(());
    }
    Err(Exit::BadInput.because(format!(
        "all {} training views have masks of refractive things already; delete those that are wrong, and this makes them anew; \
         --overwrite makes all masks in the folder anew",
        data.split.train.len()
    )))
}

/// The mask of what is refractive that a view has.
pub(super) fn given(view: &View) -> Result<Option<Arc<Mask>>, Failure> {
    if !view.has_mask() || view.mask_meaning != MaskMeaning::Refractive {
        return Ok(None);
    }
    load_mask_of(view).map_err(data_failure)
}
