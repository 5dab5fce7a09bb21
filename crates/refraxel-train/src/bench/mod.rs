//! Throughput of this machine on a fixed, dense scene: every sample inside the box is evaluated, nothing is skipped.
//!
//! A grid, of 128³ voxels where no other is asked for, with density and SH of degree 2 (28 channels), steps of one voxel. *Coherent* rays
//! are 8 × 8 tiles of one picture; *random* rays come from all around and hit the box anywhere, as training batches do.

mod objective;
mod on_device;
mod options;
mod rays;
mod refractive;
mod scene;
mod simd;
mod throughput;
mod timing;

pub use on_device::{DeviceBench, DeviceThroughput, FrameRate, Round};
pub use options::{BenchGrid, BenchOptions, UnknownGrid};
pub use refractive::{Refractive, refractive};
pub use scene::{DEGREE, model, voxels};
pub use simd::simd_level;
pub use throughput::{Throughput, straight};
