//! Hypotheses about shapes: each is a function from what views show to bodies.
//!
//! Nothing here knows an index or an error; whoever races the hypotheses against each other gives the bodies
//! one.

mod body;
mod contours;
mod crowd;
mod ellipsoid;
mod frustum;
mod polyhedron;
mod revolution;
mod shell;
mod vessel;
mod water_surface;

pub(super) use body::{ShapeBody, Substance, distance};
pub(super) use contours::Contours;
pub(super) use crowd::{Crowd, Point, points};
pub(super) use ellipsoid::{Ellipsoid, ellipsoid};
pub(super) use frustum::Frustum;
pub(super) use polyhedron::{Faceted, polyhedron};
pub(super) use revolution::revolution;
pub(super) use shell::shell;
pub(super) use vessel::{Side, Vessel, upwards, vessel};
pub(super) use water_surface::{Basin, Levels};

#[cfg(test)]
mod views;
