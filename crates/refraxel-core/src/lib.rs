//! The mathematics of refraxel: cameras, grids, spherical harmonics, emission–absorption along bent or straight rays,
//! and the exact adjoints of all of it. Equation numbers refer to `docs/theory.md`.
//!
//! Generic over [`Real`] (`f32` in production, `f64` as the oracle). No files, threads, clocks, randomness or printing.

pub mod background;
pub mod camera;
pub mod field;
pub mod grid;
pub mod index;
pub mod mesh;
pub mod optics;
pub mod optimiser;
pub mod priors;
pub mod radiance;
pub mod segment;
pub mod sh;

mod aligned;
mod ray;
mod real;
mod vec3;

pub use aligned::AlignedVec;
pub use background::{Background, EnvironmentMap};
pub use camera::{Camera, Lens, Pose};
pub use field::{FieldGradient, VoxelField};
pub use grid::{BrickMap, Domain, Extent};
pub use index::{IndexGradient, IndexGrid, Interpolation, LevelSet, Medium};
pub use mesh::Mesh;
pub use optics::{Integrator, Path, Tracer};
pub use ray::{Aabb, Ray};
pub use real::Real;
pub use sh::ShDegree;
pub use vec3::{Mat3, Vec3, vec3};
