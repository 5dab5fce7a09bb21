//! `refraxel inspect`: describes a dataset or a run and its problems.

mod data;
mod run;

use crate::cli::InspectArgs;
use crate::exit::Failure;
use refraxel_train::run::CHECKPOINT;

/// The verb.
pub fn run(args: &InspectArgs) -> Result<(), Failure> {
    if args.path.join(CHECKPOINT).is_file() {
        return run::inspect(&args.path, args.json);
    }
    let is_checkpoint = args.path.file_name().is_some_and(|name| name == CHECKPOINT);
    match args.path.parent().filter(|_| is_checkpoint) {
        Some(folder) => run::inspect(folder, args.json),
        None => data::inspect(args),
    }
}
