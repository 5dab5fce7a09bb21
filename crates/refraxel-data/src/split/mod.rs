//! Which views train and which are held out.

mod beside;
mod by_name;
mod decide;
mod lists;
mod words;

pub(crate) use beside::{lists_of, parts_of};
pub(crate) use decide::{DEFAULT_HOLDOUT, assign, decide};
pub(crate) use words::{is_of_lists, part_of_view};
