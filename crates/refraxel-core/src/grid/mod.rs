//! Grids: where they lie ([`Domain`]), which bricks they store ([`BrickMap`]), how they are interpolated ([`trilinear`])
//! and blurred ([`GaussianKernel`]).

pub mod blur;
pub mod bricks;
pub mod domain;
pub mod placement;
pub mod projection;
pub mod trilinear;

pub use blur::{Border, GaussianKernel};
pub use bricks::{BRICK, BRICK_VOXELS, BrickMap, Cell, EMPTY_SLOT};
pub use domain::{CONTRACTED_FAR, Domain, Extent};
pub use projection::{PROJECTED_FAR, Perspective, Projection};
