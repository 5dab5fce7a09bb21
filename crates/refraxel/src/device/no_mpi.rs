//! A program without MPI.

use super::process_group::Joined;
use super::refusals::unusable;
use crate::exit::Failure;
use anyhow::anyhow;
use refraxel_train::device::DeviceChoice;

/// Joins other processes: there is no way to find them.
pub fn join(choice: DeviceChoice) -> Result<Joined, Failure> {
    match choice {
        DeviceChoice::Mpi => Err(unusable(anyhow!(
            "this program was built without MPI; `cargo install --locked --path crates/refraxel --features mpi` builds one that has it, or \
             use `--device cpu`"
        ))),
        _ => Ok(Joined::Alone),
    }
}
