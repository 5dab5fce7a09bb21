//! Evidence for what stands in a refractive region, by prediction without training.
//!
//! A field that straight rays have learned from what lies beside the masks knows what glass should show: rays of the pixels inside
//! masks are traced through a candidate, a shape with an index, and what their exit rays meet in that field is compared with the
//! photographs by [structure](refraxel_core::structure), theory (4.24). Nothing learns. The right candidate shows the right edges in
//! the right places; a wrong one, an opaque thing and an empty place do not.
//!
//! The door is narrow: photographs ([`Photographs`]), a backend that holds the field with the inside of the hull cleared, and media
//! go in; scores with their errors come out.

mod detail;
mod photographs;
mod predict;
mod refine;
mod scan;
mod score;
mod shown;
#[cfg(test)]
pub(crate) mod tests;

pub(crate) use detail::Detail;
pub(crate) use photographs::Photographs;
pub(crate) use predict::{Predicted, Way, predict, rendered};
pub(crate) use refine::Refiner;
pub(crate) use scan::{Best, Unknown, first, firsts, interval, mean, refined};
pub use score::Difference;
pub(crate) use score::Scores;
pub use shown::Shown;
