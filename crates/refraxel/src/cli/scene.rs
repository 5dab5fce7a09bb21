//! Verbs that bring their own scene.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::WorkArgs;
use super::values::{Size, index};

/// `refraxel demo`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel demo
  refraxel demo --out glass_demo --threads 2")]
pub struct DemoArgs {
    /// Folder for the dataset, runs and the picture
    #[arg(long, value_name = "DIR", default_value = "refraxel-demo")]
    pub out: PathBuf,
    /// Start of the random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Switch {
    /// Yes
    On,
    /// No
    Off,
}

/// `refraxel synth`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel synth --list
  refraxel synth sphere --out sphere --size 400 --views 100
  refraxel synth sphere --out water_ball --ior 1.33 --reflection off --exr")]
pub struct SynthArgs {
    /// Name of the scene, see --list
    #[arg(value_name = "SCENE", required_unless_present = "list")]
    pub scene: Option<String>,
    /// Folder for the dataset
    #[arg(long, value_name = "DIR", required_unless_present = "list")]
    pub out: Option<PathBuf>,
    /// List the scenes
    #[arg(long, conflicts_with_all = ["scene", "out"])]
    pub list: bool,
    /// Size of the images: N or WIDTHxHEIGHT pixels [default: the scene's]
    #[arg(long, value_name = "SIZE")]
    pub size: Option<Size>,
    /// Number of training views; there are a quarter as many for testing [default: the scene's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub views: Option<u32>,
    /// Start of the random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Index of refraction [default: the scene's]
    #[arg(long, value_name = "N", value_parser = index)]
    pub ior: Option<f64>,
    /// Whether refractive surfaces also reflect [default: the scene's]
    #[arg(long, value_enum, value_name = "WHETHER")]
    pub reflection: Option<Switch>,
    /// Also write linear colours as EXR
    #[arg(long)]
    pub exr: bool,
    /// Keep the images that are there already
    #[arg(long)]
    pub resume: bool,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// `refraxel bench`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel bench
  refraxel bench --quick --json")]
pub struct BenchArgs {
    /// Measure for seconds instead of a minute, with larger error
    #[arg(long)]
    pub quick: bool,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}
