//! The detector: where refractive things are when no mask says so, found out before a run begins.
//!
//! Straight rays of few pixels and a coarse grid learn the scene for some seconds. Where light was bent, what they show of a view
//! differs from its photograph in colour and in structure (`evidence`). A place that most views see so belongs to what they cannot
//! explain (`look`).
//!
//! The run itself knows nothing of all this: it begins with what was found in place of masks, or as if nobody had looked. Whether
//! it bends rays is decided there.

mod budget;
mod complete;
mod detector;
mod evidence;
mod fit;
mod hints;
mod hull;
mod look;
mod masks;
mod photographs;
mod refine;
mod separation;
#[cfg(test)]
mod tests;

pub(crate) use budget::Budget;
pub(crate) use detector::Detector;
pub use hints::Hints;
pub use look::Found;
pub use masks::mask;
pub(crate) use masks::masks;
