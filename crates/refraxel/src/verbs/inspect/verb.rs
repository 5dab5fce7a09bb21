//! What is described: the GPUs, a run, or a dataset.

use super::data;
use crate::cli::InspectArgs;
use crate::device::devices;
use crate::exit::{Exit, Failure};
use refraxel_train::run::CHECKPOINT;

/// The verb.
pub fn run(args: &InspectArgs) -> Result<(), Failure> {
    if args.devices {
        return devices(args.json);
    }
    let path = args.path();
    let is_checkpoint = path.file_name().is_some_and(|name| name == CHECKPOINT);
    let folder = if is_checkpoint { path.parent() } else { Some(path) };
    match folder.filter(|folder| is_checkpoint || folder.join(CHECKPOINT).is_file()) {
        Some(folder) if args.out.is_some() => Err(Exit::Usage.because(format!(
            "--out draws what is in a dataset, and {} is a run; render or eval draw a run",
            folder.display()
        ))),
        Some(folder) => super::run::inspect(folder, args.json),
        None => data::inspect(args),
    }
}
