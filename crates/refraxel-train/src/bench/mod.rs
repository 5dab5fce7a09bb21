//! Throughput of this machine on a fixed, dense scene: every sample inside the box is evaluated, nothing is skipped.
//!
//! 128³ voxels with density and SH of degree 2 (28 channels), steps of one voxel. *Coherent* rays are 8 × 8 tiles of one
//! picture; *random* rays come from all around and hit the box anywhere, as training batches do.

mod objective;
mod on_device;
mod options;
mod rays;
mod refractive;
mod scene;
mod simd;
mod throughput;
mod timing;

pub use on_device::{DeviceThroughput, straight_on};
pub use options::BenchOptions;
pub use refractive::{Refractive, refractive};
pub use simd::simd_level;
pub use throughput::{Throughput, straight};
