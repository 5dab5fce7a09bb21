//! What a machine offers to those who train, render and evaluate.
//!
//! A [`Backend`] takes a [`Model`](crate::model::Model), renders it, learns from batches of rays, and gives the model back. How
//! parameters lie in its memory is its own affair. What many ask for and what is small stays on the host as a mirror image: the grid
//! of the field without its values, the medium, and whether anything mirrors.

pub mod conformance;
mod contract;
mod gradient;
mod layers;
mod marching;
mod mask;
mod mirroring;
mod objective;
mod outcome;
mod ray_gradient;
mod snapshot;
mod step;

pub use crate::rays::Batch;
pub use contract::Backend;
pub use gradient::{BatchGradient, MirrorGradient};
pub use layers::Layers;
pub use marching::Marching;
pub use mask::BrickMask;
pub use mirroring::{Caches, Mirroring};
pub use objective::{
    AbsorptionObjective, BUCKET_SLOTS, IndexObjective, Objective, REFRESH, RULE, ReflectionObjective,
    TV_EPSILON,
};
pub use outcome::StepOutcome;
pub use ray_gradient::{PixelGradient, RayGradient};
pub use snapshot::Snapshot;
pub use step::step;
