//! The refractive shape to start from.

use super::section::section;
use super::value::choice;
use super::{Allowed, Switch};

choice! {
    /// The refractive shape before it learns.
    pub enum StartShape {
        /// There is none: n = 1 everywhere.
        Uniform = "uniform",
        /// It fills the whole box.
        Block = "block",
        /// It is the ellipsoid in the box.
        Ball = "ball",
        /// It is the visual hull: the masks carve it out of the box.
        Hull = "hull",
        /// It is known: `--index-from` names its file.
        File = "file",
    }
}

section! {
    /// The refractive shape to start from, and its grid.
    pub struct ShapeOptions "shape" {
        /// The shape before it learns.
        start: StartShape = StartShape::Hull;
        /// A point is refractive if at least this share of the views agrees.
        vote: f32 = 0.95, in 0.5..=1.0;
        /// Whether planes cut off those bulges of a hull that no silhouette shows, and hulls that are nearly round about an upright axis
        /// become bodies of revolution.
        faces: Switch = Switch::On;
        /// Nodes along the longest edge of a refractive region; 0: by the pixels that it covers.
        resolution: u32 = 0, in Allowed::AutoOrWithin(16.0, 512.0), "nodes";
    }
}
