//! Steps that any backend may leave to the host: those of the index of refraction, of its surfaces, of what bodies absorb and of what
//! surfaces mirror. Their grids are small beside the field.

mod absorption;
mod adam;
mod index;
mod mirrors;
mod surface;

pub use absorption::update_absorption;
pub use index::{IndexStep, update_index};
pub use mirrors::{update_clearcoat, update_mirrors};
