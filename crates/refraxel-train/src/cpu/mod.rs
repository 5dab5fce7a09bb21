//! The CPU backend: threads over chunks of rays, SIMD over the channels of a voxel.
//!
//! A step has two halves. First every chunk of rays walks through the scene and back (`walk`), leaving one record per
//! sample (`tape`). Then every bucket of voxels adds up its own records in order, adds its priors and
//! takes its optimiser step while the gradient is still in the cache (`update`). No gradient of the whole field ever exists,
//! nothing is locked, and the result does not depend on the number of threads, nor on that of processes that share a step
//! (`shared`).

mod absorption;
mod backend;
mod caches;
mod clearcoat;
mod colour;
mod composite;
mod index;
mod layout;
mod march;
mod marcher;
mod mirror;
mod mirrored;
mod node_map;
mod optics16;
mod order;
#[cfg(test)]
mod overflow;
mod packet;
mod passes;
mod prefetch;
mod record;
mod render;
mod sample;
mod scene;
mod shared;
mod tape;
mod trace;
mod update;
mod variation;
mod view;
mod walk;

pub use backend::CpuBackend;
pub use shared::{Root, SharedBackend, serve};
