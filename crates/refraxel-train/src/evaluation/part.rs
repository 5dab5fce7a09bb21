//! The parts of a dataset.

use refraxel_data::Dataset;
use serde::{Deserialize, Serialize};

/// A part of a dataset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The images trained on.
    Train,
    /// The images looked at during training.
    Val,
    /// The held-out images.
    #[default]
    Test,
}

impl Part {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::Test => "test",
        }
    }

    /// Its views, as indices.
    pub fn views(self, data: &Dataset) -> &[usize] {
        match self {
            Self::Train => &data.split.train,
            Self::Val => &data.split.val,
            Self::Test => &data.split.test,
        }
    }
}
