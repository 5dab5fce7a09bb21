//! Verbs that bring their own scene.

use std::path::PathBuf;

use clap::Args;
use refraxel_data::synth::{CameraSet, Imperfection};
use refraxel_train::bench::BenchGrid;
use refraxel_train::device::DeviceChoice;
use refraxel_train::options::Switch;

use super::values::{ON_OFF, index, words};
use super::work::WorkArgs;

/// `refraxel demo`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel demo
  refraxel demo --out glass_demo --threads 2")]
pub struct DemoArgs {
    /// Folder for the dataset, runs and the picture
    #[arg(long, value_name = "DIR", default_value = "refraxel-demo")]
    pub out: PathBuf,
    /// Seed of the random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// From which directions a synthetic scene is seen.
const AROUND: [(&str, &str, CameraSet); 2] = [
    ("upper", "From above the ground", CameraSet::Upper),
    ("full", "From all sides, also from below", CameraSet::Full),
];

/// `refraxel synth`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel synth --list
  refraxel synth glass_ball --out ball --size 400 --views 100
  refraxel synth glass_ball --out water_ball --ior 1.33 --reflection off --exr
  refraxel synth kitchen_bear --out bear --photographic
  refraxel synth kitchen_bear --out bear_sharp --photographic --without focus,noise

Ctrl-C keeps the finished pictures; the same command continues from there.")]
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
    /// Photographs of a room as a phone takes them, 4:3: with noise, poses a little off, rough masks and more
    #[arg(long, conflicts_with_all = ["cameras", "mesh", "exr"])]
    pub photographic: bool,
    /// Imperfections that the photographs do not have, with commas: exposure, noise, jpeg, poses, focus, masks
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "photographic")]
    pub without: Vec<Imperfection>,
    /// Width of the pictures, in pixels; they are square, photographs 4:3 [default: 200, photographs 480]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=8192))]
    pub size: Option<u32>,
    /// Number of training views; 2/5 as many are added for testing and 1/10 for validation, to photographs 4/15 for testing
    /// [default: 100, photographs 60]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=50_000))]
    pub views: Option<u32>,
    /// Seed of the random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Index of refraction of the main body [default: the scene's]
    #[arg(long, value_name = "N", value_parser = index)]
    pub ior: Option<f64>,
    /// Whether refractive surfaces also reflect
    #[arg(long, value_parser = words(&ON_OFF), default_value = "on", value_name = "WHETHER")]
    pub reflection: Switch,
    /// Directions from which the scene is seen
    #[arg(long, value_parser = words(&AROUND), default_value = "upper", value_name = "WHERE")]
    pub cameras: CameraSet,
    /// Samples per pixel, rounded up to a square number [default: 16, photographs 4]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub spp: Option<u32>,
    /// Samples per pixel where the first samples differ; 0 adds none [default: 64, photographs 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=65_536))]
    pub detail_spp: Option<u32>,
    /// Cells along the longest edge of the stored index field; 0 stores none [default: 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1024))]
    pub index_resolution: Option<u32>,
    /// Wavefront OBJ file whose mesh replaces the knot in glass_mesh
    #[arg(long, value_name = "FILE")]
    pub mesh: Option<PathBuf>,
    /// Also write linear colours as EXR
    #[arg(long)]
    pub exr: bool,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}

/// `refraxel bench`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel bench
  refraxel bench --quick --json
  refraxel bench --device gpu --grid sparse")]
pub struct BenchArgs {
    /// Measure for a few seconds instead of a minute, less exactly
    #[arg(long)]
    pub quick: bool,
    /// The device to measure: cpu, gpu, or gpu:N as inspect --devices lists them; auto: a GPU, if there is one
    ///
    /// On a GPU, whole pictures are rendered, too, and kernels are timed one by one.
    #[arg(long, value_name = "DEVICE", default_value = "cpu")]
    pub device: DeviceChoice,
    /// The grid: a number of nodes along each axis, or sparse: a shell of one of 512
    #[arg(long, value_name = "GRID", default_value = "128")]
    pub grid: BenchGrid,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}
