//! Models as differentiable functions of their parameters: rendering of rays, and its transpose.

mod class;
mod fields;
mod gradients;
mod methods;
mod parameters;
mod state;

pub use class::Model;
