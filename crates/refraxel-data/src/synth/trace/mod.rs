//! The exact tracer: straight flights between closed-form crossings, adaptive integration in graded media, and a tree
//! of reflected and transmitted rays at every interface.
//!
//! What is transported is the basic radiance L/n², which is invariant along a ray, theory (1.4); so no factor n²
//! appears anywhere.

mod flight;
mod limits;
mod radiance;
mod tracer;

pub use limits::{Limits, Reflection, Tally};
pub(super) use tracer::Beam;
pub use tracer::Tracer;
