//! Steps that any backend may leave to the host: those of the index of refraction, of its surfaces and of what bodies absorb. Their
//! grids are small beside the field.

mod absorption;
mod adam;
mod index;
mod surface;

pub use absorption::update_absorption;
pub use index::{IndexStep, update_index};
