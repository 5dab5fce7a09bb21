//! OpenSfM `reconstruction.json`, which OpenDroneMap writes too (`opensfm/reconstruction.json`).

mod parse;
mod read;

pub(crate) use read::{find, read};
