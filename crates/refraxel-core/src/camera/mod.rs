//! Cameras: from a pixel to a ray in world coordinates.
//!
//! Camera frame (OpenCV): x right, y down, z forward. Pixels are continuous: the image covers [0, W] × [0, H], row 0 on
//! top, and pixel (i, j) has its centre at (i + ½, j + ½). Importers convert every other convention to this one.

mod distortion;
mod lens;
mod posed;

pub use lens::Lens;
pub use posed::{Camera, Pose};
