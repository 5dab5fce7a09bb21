//! Grids: where they lie ([`Domain`]), which bricks they store ([`BrickMap`]), and how they are interpolated
//! ([`trilinear`]).

pub mod bricks;
pub mod domain;
pub mod trilinear;

pub use bricks::{BRICK, BRICK_VOXELS, BrickMap, Cell, EMPTY_SLOT};
pub use domain::{CONTRACTED_FAR, Domain, Extent};
