//! Datasets: reading every format and option, and the exact tracer that writes some. One program, which is linked once and whose tests
//! share the processors; only the damages of `robustness.rs` limit the memory of a process of their own.

#[path = "../fixture/mod.rs"]
mod fixture;

mod alpha;
mod backdrop;
mod depth;
mod formats;
mod half_read;
mod images;
mod masks;
mod memory;
mod names;
mod orientation;
mod pictures;
mod readings;
mod shared_scenes;
mod splits;
mod synth_independent;
mod synth_output;
mod synth_photographs;
mod synth_physics;
mod synth_scenes;
mod tools;
mod transforms;
