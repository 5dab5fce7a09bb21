//! What views say about where a refractive object can be.

mod gaps;
mod outlines;
mod tangent;
#[cfg(test)]
mod tests;
mod view;

#[cfg(test)]
pub use outlines::MAP_BYTES;
pub use outlines::Outlines;
pub(crate) use tangent::Tangent;
pub(super) use view::Outline;
pub use view::Silhouette;
