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
        /// Gaps in masks that are narrower than this are closed where nearly all views see glass: a straw in front of it is too
        /// thin to be known as something opaque [part of the longest edge of the picture].
        gap: f64 = 0.03, in 0.0..=0.5;
        /// Whether planes cut off the bulges of a hull that no silhouette shows, and hulls that are round about an upright axis are
        /// made so.
        faces: Switch = Switch::On;
        /// A body whose outlines leave those of an ellipsoid by at most this part of its radius, and by 0.2 pixel, is taken for
        /// one; 0: by 0.2 pixel.
        ellipsoid: f64 = 0.01, in 0.0..=1.0;
        /// Standard deviation of the blur of the shape [voxel of the index grid].
        smooth: f32 = 0.7, in 0.0..=8.0, "voxels";
        /// Whether only rays bend that would meet the shape on a straight line.
        gate: Switch = Switch::On;
        /// Whether the index is free inside the shape, and not only at its surface.
        interior: Switch = Switch::On;
        /// Nodes along the longest edge of a refractive region; 0: as many as `voxels_per_pixel` asks for.
        resolution: u32 = 0, in Allowed::AutoOrWithin(16.0, 512.0), "nodes";
        /// Voxels of the index grid per pixel at a refractive region.
        voxels_per_pixel: f64 = 0.7, in 0.05..=4.0;
    }
}
