//! The mathematics of refraxel: cameras, grids, spherical harmonics, bent rays, emission and absorption along them, and the
//! exact adjoints of all of it. Equation numbers refer to `docs/theory.md`.
//!
//! Everything is generic over [`Real`] (`f32` in production, `f64` as the oracle). The crate has no files, threads, clocks,
//! randomness or printing.
//!
//! How light goes through the modules: [`camera`] turns a pixel into a [`Ray`]; [`optics`] bends it in a medium of
//! [`index`] fields into a [`Path`] of straight segments ([`segment`]); [`radiance`] marches these through the voxels of a
//! [`field`], which lie on a [`grid`] and have colours in spherical harmonics ([`sh`]); the [`background`] fills what is
//! left. Backwards, each module has the transpose of its forward function next to it. `d_x` is always dLoss/dx and has the
//! type of `x`.
//!
//! A backend reads these functions as its specification: it may be faster, and is tested to agree with them.

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
pub mod structure;

mod aligned;
mod pages;
mod ray;
mod real;
mod vec3;

pub use aligned::AlignedVec;
pub use background::{Background, EnvironmentMap};
pub use camera::{Camera, Lens, Pose};
pub use field::{FieldGradient, VoxelField};
pub use grid::{BrickMap, Domain, Extent, Projection};
pub use index::{IndexGradient, IndexGrid, Interpolation, LevelSet, Medium};
pub use mesh::Mesh;
pub use optics::{Integrator, Path, Tracer};
pub use ray::{Aabb, Ray};
pub use real::Real;
pub use sh::ShDegree;
pub use vec3::{Mat3, Vec3, vec3};
