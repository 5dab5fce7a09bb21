//! How grids interpolate between their nodes, theory (2.5)–(2.7).

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
