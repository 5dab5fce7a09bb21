//! A program without GPUs.

use super::{Decided, Needs, Work, only_train, unusable};
use crate::cli::BenchArgs;
use crate::exit::Failure;
use anyhow::anyhow;
use refraxel_train::device::DeviceChoice;
use std::convert::Infallible;

/// There is none.
pub type Gpu = Infallible;

/// The CPU, unless another device is asked for.
pub fn open(choice: DeviceChoice, _: Option<Needs>) -> Result<Decided, Failure> {
    match choice {
        DeviceChoice::Auto | DeviceChoice::Cpu => Ok(Decided::cpu(None)),
        DeviceChoice::Gpu | DeviceChoice::Adapter(_) => Err(missing()),
        DeviceChoice::Mpi => Err(only_train()),
    }
}

/// Lists adapters: nobody can.
pub fn devices(_: bool) -> Result<(), Failure> {
    Err(missing())
}

/// Does work on a GPU: there is none.
pub fn on_gpu<W: Work>(gpu: Gpu, _: W) -> Result<W::Out, Failure> {
    match gpu {}
}

/// Measures a GPU: there is none.
pub fn bench(gpu: Gpu, _: &BenchArgs) -> Result<(), Failure> {
    match gpu {}
}

fn missing() -> Failure {
    unusable(anyhow!(
        "this program was built without GPUs; build it with them by `cargo install --path crates/refraxel --features gpu`, or use \
         `--device cpu`"
    ))
}
