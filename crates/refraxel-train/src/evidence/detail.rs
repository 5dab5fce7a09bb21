//! From coarse pictures to fine ones.

use refraxel_core::structure::Structure;

/// How coarse pictures are that are compared: in coarse ones a candidate may be further from the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Detail {
    /// Pixels four times as large: an index within 0.08 of the truth shows.
    Coarse,
    /// Twice as large.
    Middle,
    /// As they are.
    Fine,
}

impl Detail {
    /// From coarse to fine.
    pub(crate) const ALL: [Self; 3] = [Self::Coarse, Self::Middle, Self::Fine];

    /// Edge of a pixel [pixel of the finest].
    pub(super) fn factor(self) -> usize {
        match self {
            Self::Coarse => 4,
            Self::Middle => 2,
            Self::Fine => 1,
        }
    }

    /// Rays per pixel and axis.
    pub(super) fn rays(self) -> usize {
        self.factor().min(2)
    }

    /// The comparison of such pictures: windows and high-passes [pixel].
    pub(crate) fn structure(self) -> Structure<f32> {
        match self {
            Self::Coarse => Structure::new(3.0, 1.5),
            _ => Structure::new(4.0, 2.0),
        }
    }
}
