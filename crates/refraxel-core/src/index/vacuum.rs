//! The vacuum around the fields of index grids, and how far it reaches into their boxes.

/// Layers of nodes along each face of a box that are no parameters, but vacuum [node]. Three layers make
/// the outermost cells vacuum, so that a B-spline is C² at the faces.
pub const BORDER: usize = 3;

/// w of vacuum, where n = 1 [1].
pub const VACUUM: f64 = 0.5;
