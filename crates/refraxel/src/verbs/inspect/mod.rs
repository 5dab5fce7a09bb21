//! `refraxel inspect`: describes a dataset or a run and its problems, or the GPUs of this machine.

mod data;
mod run;

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
        return run::inspect(path, args.json);
    }
    let is_checkpoint = path.file_name().is_some_and(|name| name == CHECKPOINT);
    match path.parent().filter(|_| is_checkpoint) {
        Some(folder) => run::inspect(folder, args.json),
        None => data::inspect(args),
    }
}
