//! What is described: the GPUs, a run, or a dataset.

use super::data;
use crate::cli::InspectArgs;
use crate::device::devices;
use crate::exit::Failure;
use refraxel_train::run::CHECKPOINT;

/// The verb.
pub fn run(args: &InspectArgs) -> Result<(), Failure> {
    if args.devices {
        return devices(args.json);
    }
    let path = args.path();
    if path.join(CHECKPOINT).is_file() {
        return super::run::inspect(path, args.json);
    }
    let is_checkpoint = path.file_name().is_some_and(|name| name == CHECKPOINT);
    match path.parent().filter(|_| is_checkpoint) {
        Some(folder) => super::run::inspect(folder, args.json),
        None => data::inspect(args),
    }
}
