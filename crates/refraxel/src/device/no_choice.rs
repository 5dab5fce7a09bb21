//! The choice of a device in a program without GPUs.

use super::none::missing;
use super::opened::{Decided, Needs};
use super::refusals::only_train;
use crate::exit::Failure;
use refraxel_train::device::DeviceChoice;

/// The CPU, unless another device is asked for.
pub fn open(choice: DeviceChoice, _: Option<Needs>) -> Result<Decided, Failure> {
    match choice {
        DeviceChoice::Auto | DeviceChoice::Cpu => Ok(Decided::cpu(None)),
        DeviceChoice::Gpu | DeviceChoice::Adapter(_) => Err(missing()),
        DeviceChoice::Mpi => Err(only_train()),
    }
}
