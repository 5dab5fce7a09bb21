//! Many runs from one plan.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::Args;

use super::work::WorkArgs;

/// `refraxel sweep`
#[derive(Args, Debug)]
#[command(after_help = "A plan is a TOML file:
  [data]                              # name = dataset, from the plan's folder
  ball = \"scenes/ball\"
  [options]                           # of every run
  \"run.minutes\" = 2
  [vary]                              # one run for every combination
  \"refraction.bend\" = [\"off\", \"on\"]
  \"run.seed\" = [0, 1, 2]

Examples:
  refraxel sweep plan.toml --out sweep --list          lists the runs, and which of them are done
  refraxel sweep plan.toml --out sweep                 trains the missing runs; repeat to continue
  refraxel sweep plan.toml --out sweep --slurm a.sh    writes an array script for Slurm
  sbatch a.sh                                          runs them on a cluster

Scores are collected in sweep/results.csv and sweep/index.html.")]
pub struct SweepArgs {
    /// The plan, a TOML file
    #[arg(value_name = "PLAN")]
    pub plan: PathBuf,
    /// Folder for the runs, the table and the page
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// List the runs and do nothing else
    #[arg(long, conflicts_with_all = ["only", "slurm"])]
    pub list: bool,
    /// Train this run alone; runs are numbered from 0 as --list shows them
    #[arg(long, value_name = "NUMBER", conflicts_with = "slurm")]
    pub only: Option<usize>,
    /// Write a Slurm array script that trains all runs, and do nothing else
    #[arg(long, value_name = "FILE")]
    pub slurm: Option<PathBuf>,
    /// Number of runs that train at the same time, each with its share of the threads
    #[arg(long, value_name = "N", default_value_t = NonZeroU16::MIN)]
    pub jobs: NonZeroU16,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}
