//! One region of refractive index: coefficients of w = n²/2 on the nodes of a box, theory (2.4).
//!
//! [`index_grid`] says what a grid is and gives access to its parameters, [`build`] makes grids, [`sample`] evaluates them.

mod build;
mod index_grid;
mod sample;

pub use index_grid::IndexGrid;
