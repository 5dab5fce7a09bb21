//! A convex body with flat faces, from silhouettes.
//!
//! Every line of sight through a contour touches the body at an edge. A set of planes predicts all contours;
//! the planes are those with the least misfit plus a price per plane. They start where normals of the visual
//! hull crowd. Faces that no view sees edge-on are found too: their edges show in silhouettes, so the roofs
//! of a visual hull do not matter.

mod boundary;
mod fit;
mod outlined;
mod search;
#[cfg(test)]
mod tests;

pub(in crate::refraction_search) use outlined::{Faceted, polyhedron};
