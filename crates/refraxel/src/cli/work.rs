//! Flags of the verbs that take a while.

use clap::Args;

/// How many threads to use and how much to print; shared by the verbs that take a while.
#[derive(Args, Clone, Debug)]
pub struct WorkArgs {
    /// Threads to use, at most 1024 [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Show no progress
    #[arg(long, short)]
    pub quiet: bool,
    /// Print the result as JSON on standard output, and nothing else there
    #[arg(long)]
    pub json: bool,
}
