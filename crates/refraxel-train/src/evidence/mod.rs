//! Evidence for what stands in a refractive region, by prediction without training.
//!
//! A field that straight rays have learned from what lies beside the masks knows what glass should show: rays of the pixels inside
//! masks are traced through a candidate, a shape with an index, and what their exit rays meet in that field is compared with the
//! photographs by [structure](refraxel_core::structure), theory (4.24). Nothing learns. The right candidate shows the right edges in
//! the right places; a wrong one, an opaque thing and an empty place do not.
//!
//! The door is narrow: photographs ([`Photographs`]), a backend that holds the field with the inside of the hull cleared, and media
//! go in; scores with their errors come out.

mod photographs;
mod predict;
mod refine;
mod scan;
mod score;
mod shown;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use photographs::Photographs;
pub(crate) use predict::{Predicted, Way, predict, rendered};
pub(crate) use refine::Refiner;
pub(crate) use scan::{Best, Unknown, first, interval, mean, refined};
pub use score::Difference;
pub(crate) use score::Scores;
pub use shown::Shown;

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
    fn factor(self) -> usize {
        match self {
            Self::Coarse => 4,
            Self::Middle => 2,
            Self::Fine => 1,
        }
    }

    /// Rays per pixel and axis.
    fn rays(self) -> usize {
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
