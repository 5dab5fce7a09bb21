//! How many threads work.

use crate::cli::WorkArgs;
use crate::exit::{Exit, Failure, OrExit};
use anyhow::Context;

/// Starts as many threads as asked for.
pub fn set_threads(work: &WorkArgs) -> Result<(), Failure> {
    set_thread_count(work.threads)
}

/// Starts so many threads, or one per core.
pub fn set_thread_count(threads: Option<u16>) -> Result<(), Failure> {
    let threads = threads.map_or(0, usize::from);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .context("cannot start the threads; try a smaller --threads")
        .or_exit(Exit::Io)
}
