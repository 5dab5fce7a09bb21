//! Training, from one step of a backend to a whole session. One program, which is linked once and whose tests share the processors;
//! only the damages of `damage.rs` limit the memory of a process of their own.

mod bits;
mod coordinates;
mod cpu_backend;
mod detection;
mod exact_tracer;
mod opaque;
mod peers;
mod poses;
mod scenes;
mod session;
mod some_masks;
mod vjp;
