//! The parts of a split.

use crate::dataset::Dataset;
use serde::{Deserialize, Serialize};

/// A part of the split of a dataset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Part {
    /// The views trained on.
    Train,
    /// The views looked at during training.
    Val,
    /// The held-out views.
    Test,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Train, Self::Val, Self::Test];

    /// Its name on the command line, in files and folders.
    pub fn name(self) -> &'static str {
        match self {
            Self::Train => "train",
            Self::Val => "val",
            Self::Test => "test",
        }
    }

    /// The part that a word means; what is there to evaluate is held out.
    pub(crate) fn named(word: &str) -> Option<Self> {
        match word.to_ascii_lowercase().as_str() {
            "train" | "training" | "trainval" => Some(Self::Train),
            "val" | "valid" | "validation" => Some(Self::Val),
            "test" | "testing" | "eval" | "evaluation" | "heldout" | "holdout" => Some(Self::Test),
            _ => None,
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
