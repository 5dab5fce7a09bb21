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
mod lattice;
mod level_set;
mod medium;
mod prefilter;
pub mod priors;
mod smooth;
mod stencil;

#[cfg(test)]
pub(crate) mod tests;

pub use facets::CUTS;
pub use flat::FLAT;
pub use grid::IndexGrid;
pub use lattice::NUDGE;
pub use level_set::{BORDER_VALUE, LevelSet, TOUCH};
pub use medium::{IndexGradient, Medium, MediumGradient, Overlap};

/// Layers of nodes along each face of a box that are no parameters, but vacuum [node]. Three layers make
/// the outermost cells vacuum, so that a B-spline is C² at the faces.
pub const BORDER: usize = 3;

/// w of vacuum, where n = 1 [1].
pub const VACUUM: f64 = 0.5;

/// How w and its gradient follow from the coefficients at the nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Cubic B-spline, theory (2.5): w is C² and depends on 64 coefficients per point. The coefficients are not the values
    /// at the nodes.
    #[default]
    CubicBSpline,
    /// Trilinear w, and for the force the trilinear interpolation of central differences at the nodes, theory (2.6). This
    /// force is continuous, but not the gradient of its w.
    TrilinearOfDifferences,
    /// Trilinear w and its gradient, theory (2.7): the force jumps at cell faces, and the diagonal of its derivative is 0
    /// almost everywhere. Derivatives of bent rays are wrong: a glass ball's by the index are 0.05 (median) of Snell's.
    /// Kept as evidence.
    Trilinear,
}

impl Interpolation {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::CubicBSpline, Self::TrilinearOfDifferences, Self::Trilinear];
}
