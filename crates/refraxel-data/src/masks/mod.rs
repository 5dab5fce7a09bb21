//! Masks: where they are, how their files are read, and what their white means.

pub(crate) mod coverage;
mod decide;
mod meaning;
mod odd;
mod places;
mod sides;
mod summary;

pub(crate) use decide::{MaskFile, Stated, decide, find};
pub(crate) use meaning::meaning_shown;
pub(crate) use places::{mask_folders, names_beside, names_in_folder};
pub(crate) use summary::summary;
