//! The device of a run: the CPU; a GPU where the program was built with the feature `gpu`; or the CPUs of several processes where it
//! was built with the feature `mpi`.

#[cfg(feature = "gpu")]
mod choice;
mod decide;
#[cfg(feature = "gpu")]
mod gpu;
#[cfg(feature = "gpu")]
mod gpu_bench;
#[cfg(feature = "mpi")]
mod mpi;
#[cfg(not(feature = "gpu"))]
mod no_choice;
#[cfg(not(feature = "mpi"))]
mod no_mpi;
#[cfg(not(feature = "gpu"))]
mod none;
mod opened;
mod process_group;
mod refusals;
mod viewer;

#[cfg(feature = "gpu")]
pub use choice::open;
pub use decide::decide;
#[cfg(feature = "gpu")]
pub use gpu::{Gpu, devices};
#[cfg(feature = "gpu")]
pub use gpu_bench::bench;
#[cfg(feature = "mpi")]
pub use mpi::join;
#[cfg(not(feature = "gpu"))]
pub use no_choice::open;
#[cfg(not(feature = "mpi"))]
pub use no_mpi::join;
#[cfg(not(feature = "gpu"))]
pub use none::{Gpu, bench, devices};
pub use opened::{Decided, Needs, Opened};
pub use process_group::{Joined, ProcessGroup};
pub use viewer::ModelViewer;
