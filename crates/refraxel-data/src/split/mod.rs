//! Which views train and which are held out.

mod beside;
mod by_name;
mod decide;
mod lists;
mod words;

pub(crate) use beside::lists_of;
pub(crate) use decide::{assign, decide};
