//! The program's verbs, and how a command line is read.

use super::data::{InspectArgs, TrainArgs};
use super::import::ImportArgs;
use super::mask::MaskArgs;
use super::run::{CompareArgs, EvalArgs, ExportArgs, RenderArgs};
use super::scene::{BenchArgs, DemoArgs, SynthArgs};
use super::sweep::SweepArgs;
use super::view::ViewArgs;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;

/// Reconstructs scenes with glass, water and other refractive objects from photographs, with rays that bend.
#[derive(Debug, Parser)]
#[command(version, subcommand_required = true, arg_required_else_help = true)]
#[command(after_help = "Examples:
  refraxel demo                         a glass scene from start to score, in about a minute
  refraxel import photos --out scene    poses for plain photographs
  refraxel inspect my_photos            what a dataset contains, and its problems
  refraxel train my_photos --out run    train on photographs with poses

Exit codes: 0 done, 2 usage, 3 bad input, 4 files and disks, 5 numerical failure, 6 no usable GPU, 101 \
a bug, 130 interrupted.")]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

impl Cli {
    /// The command line of this process; ends it with a message where that is wrong.
    pub fn read() -> Self {
        let matches = Self::with_negative_numbers().get_matches();
        Self::from_arg_matches(&matches).unwrap_or_else(|error| error.exit())
    }

    /// A training, by the words of its command line that follow `train`.
    pub fn training<W: Into<OsString> + Clone>(
        words: impl IntoIterator<Item = W>,
    ) -> clap::error::Result<TrainArgs> {
        let words =
            ["refraxel", "train"].into_iter().map(OsString::from).chain(words.into_iter().map(W::into));
        match Self::try_parse_from(words)?.verb {
            Verb::Train(args) => Ok(args),
            _ => unreachable!("it is a training"),
        }
    }

    /// The definition of the command line, in which `-1` after a flag is its value: what is wrong with it is then said of
    /// the number, not of a flag called `-1`.
    pub fn with_negative_numbers() -> clap::Command {
        let takes_value = |arg: &clap::Arg| arg.get_action().takes_values() && !arg.is_positional();
        let number = move |arg: clap::Arg| {
            let takes = takes_value(&arg);
            arg.allow_negative_numbers(takes)
        };
        Self::command().mut_subcommands(move |verb| verb.mut_args(number))
    }
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Verb {
    /// Makes a glass scene, trains on it and compares the result with the truth
    Demo(DemoArgs),
    /// Computes the camera poses of photographs or of a video with COLMAP, and writes a dataset
    Import(ImportArgs),
    /// Shows the contents of a dataset or run: cameras, masks, split, problems, memory
    Inspect(InspectArgs),
    /// Makes masks of glass and water: from clicks, boxes or outlines in some photographs, or without these
    Mask(MaskArgs),
    /// Trains on a dataset and evaluates the held-out images
    Train(TrainArgs),
    /// Renders and scores the held-out images of a run
    Eval(EvalArgs),
    /// Renders new views of a run
    Render(RenderArgs),
    /// Shows a run live in the browser: look around, change the index, follow a ray; without a run, opens the start page
    View(ViewArgs),
    /// Writes meshes, points, Gaussians, a page to share, or cameras
    Export(ExportArgs),
    /// Compares runs in a table and in side-by-side pictures
    Compare(CompareArgs),
    /// Trains many runs from a plan, and compares their scores in a table and a page
    Sweep(SweepArgs),
    /// Makes a synthetic dataset with exact refraction and known truth
    Synth(SynthArgs),
    /// Measures how fast this machine renders and trains
    Bench(BenchArgs),
    /// Prints a completion script for a shell
    #[command(after_help = "Examples:
  refraxel completions bash > ~/.local/share/bash-completion/completions/refraxel
  refraxel completions zsh > ~/.zfunc/_refraxel")]
    Completions {
        /// The shell to complete in
        shell: clap_complete::Shell,
    },
}
