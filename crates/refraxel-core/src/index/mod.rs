//! The index of refraction: smooth fields on boxes of their own, theory (2.4)–(2.9) and (2.22)–(2.23).
//!
//! The grids store **w = n²/2**, so that the force on a ray, dp/dt = ∇w, is linear in the parameters. An [`IndexGrid`]
//! fills one box; a [`Medium`] is any number of them in vacuum, n = 1. The three outermost layers of nodes of
//! each grid are held at n = 1: the field is C² also at the faces of its box.
//!
//! Where the index jumps, a grid has a [`LevelSet`] in addition, whose zero level is the surface of a body, theory (2.22).
//! Bodies may lie in each other, the one that rules being last in the list, theory (2.23).

mod distance;
mod facets;
mod flat;
mod grid;
mod hull;
mod interpolation;
mod lattice;
mod level_set;
mod medium;
mod prefilter;
pub mod priors;
mod smooth;
mod stencil;
mod vacuum;

#[cfg(test)]
pub(crate) mod tests;

pub use facets::CUTS;
pub use flat::{FLAT, distance_to};
pub use grid::IndexGrid;
pub use interpolation::Interpolation;
pub use lattice::NUDGE;
pub use level_set::{BORDER_VALUE, LevelSet, TOUCH};
pub use medium::{IndexGradient, Medium, MediumGradient, Overlap};
pub use vacuum::{BORDER, VACUUM};
