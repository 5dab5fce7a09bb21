//! The mathematics of refraxel: cameras, grids, spherical harmonics, emission–absorption along bent or straight rays,
//! and the exact adjoints of all of it. Equation numbers refer to `docs/theory.md`.
//!
//! Generic over [`Real`] (`f32` in production, `f64` as the oracle). No files, threads, clocks, randomness or printing.

pub mod camera;
mod ray;
mod real;
mod vec3;

pub use camera::{Camera, Lens, Pose};
pub use ray::{Aabb, Ray};
pub use real::Real;
pub use vec3::{Mat3, Vec3, vec3};
