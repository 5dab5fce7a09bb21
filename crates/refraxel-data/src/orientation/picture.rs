//! Orientations, and pictures that may have one.

use crate::decoding::Header;
use crate::parsed::Frame;
use serde::{Deserialize, Serialize};

/// Which pixels of photographs with an orientation tag (EXIF) are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Orientation {
    /// Those of the file, whatever the tag says: as programs that compute poses read them.
    Stored,
    /// Those that the tag asks for, as programs that show photographs turn them.
    Upright,
}

impl Orientation {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stored => "stored",
            Self::Upright => "upright",
        }
    }

    pub(super) fn other(self) -> Self {
        match self {
            Self::Stored => Self::Upright,
            Self::Upright => Self::Stored,
        }
    }
}

/// A frame and what the file of its image says.
pub(crate) type Picture<'a> = (&'a Frame, &'a Header);
