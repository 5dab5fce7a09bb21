//! The GPU backend: one more [`Backend`](refraxel_train::Backend), in WGSL through wgpu, on Vulkan, Metal and DirectX 12.
//!
//! [`Gpu`] is an adapter that was opened; [`GpuBackend`] keeps a model in its memory, renders it and learns its parameters.
//! A kernel (`kernels.rs`) is a concatenation of small files of `shaders/`, preceded by its bindings and by constants that are
//! those of the Rust code. `naga` validates all of them in a unit test that needs no adapter.
//!
//! What the backend does not have (rules of integration other than leapfrog) it refuses, see [`Unsupported`]: it never computes
//! something else instead.
//!
//! **Sums are exact.** Gradients are added in fixed point of 64 bits (`shaders/fixed.wgsl`): the order in which rays arrive
//! changes nothing, and the same input gives the same bits on one adapter.

mod adapter_memory;
mod adapters;
mod backend;
mod bending;
mod bodies;
mod caches;
mod clock;
mod coats;
mod constants;
mod demand;
mod device;
mod drawing;
mod error;
mod field;
mod gates;
mod gpu;
mod gradients;
mod kernels;
mod learn;
mod loaded;
mod memory;
mod photographs;
mod pools;
mod rays;
mod reflections;
mod renderer;
mod shape;
mod show;
mod sources;
mod step;
mod sums;
mod task;
mod timing;
mod weights;

pub use adapters::{Adapter, AdapterKind, adapters};
pub use backend::GpuBackend;
pub use clock::KernelTime;
pub use device::Traffic;
pub use error::{GpuError, Unsupported};
pub use gpu::Gpu;
pub use refraxel_train::device::DeviceChoice;
pub use renderer::GpuRenderer;
