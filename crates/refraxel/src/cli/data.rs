//! Verbs that read a dataset.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use refraxel_data::{AlphaMeaning, Backdrop, Crop, MaskMeaning, Orientation, Reduction};
use refraxel_train::device::DeviceChoice;
use refraxel_train::options::Switch;

use super::values::{ON_OFF, Setting, direction, minutes, words};
use super::work::WorkArgs;

/// How to read a dataset.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Reading the dataset")]
pub struct ReadingArgs {
    /// Hold out every N-th image, by file name, for testing [default: the dataset's own split, else 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..))]
    pub holdout: Option<u32>,
    /// The backdrop of the scene: surroundings, transparent or a colour such as '#ffffff' [default: as the files or the borders of
    /// the photographs show]
    #[arg(long, value_name = "BACKDROP")]
    pub backdrop: Option<Backdrop>,
    /// The meaning of the alpha channels of photographs: backdrop (nothing is where alpha is 0), mask (of a whole photograph), or ignore
    /// [default: by the colours below alpha 0]
    #[arg(long, value_name = "MEANING")]
    pub alpha: Option<AlphaMeaning>,
    /// The meaning of white in the masks [default: by their names, else by comparing neighbouring photographs]
    #[arg(long, value_name = "MEANING", value_parser = words(&WHITE_MEANS))]
    pub mask_meaning: Option<MaskMeaning>,
    /// Also read files that the dataset names outside its own folder
    #[arg(long)]
    pub allow_outside: bool,
    /// Numbers of pixels to cut off each photograph and mask: on the left, on top, on the right, at the bottom
    #[arg(long, value_name = "L,T,R,B")]
    pub crop: Option<Crop>,
    /// Which pixels of photographs with an orientation tag (EXIF) the poses belong to [default: by their shapes, by the colours
    /// of points, else those stored]
    #[arg(long, value_name = "WHICH", value_parser = words(&POSED_PIXELS))]
    pub orientation: Option<Orientation>,
    /// Which way is up in the data's coordinates [default: the mean of the cameras' upward directions]
    #[arg(long, value_name = "X,Y,Z", value_parser = direction, allow_hyphen_values = true)]
    pub up: Option<[f64; 3]>,
}

/// Which pixels of photographs with an orientation tag are posed.
const POSED_PIXELS: [(&str, &str, Orientation); 2] = [
    ("stored", "Those of the files, whatever the tag says", Orientation::Stored),
    ("upright", "Those that the tag asks for", Orientation::Upright),
];

/// What white means in a mask.
pub(super) const WHITE_MEANS: [(&str, &str, MaskMeaning); 3] = [
    ("refractive", "The refractive object is the first thing hit", MaskMeaning::Refractive),
    ("keep", "The pixel is used, black ones are ignored", MaskMeaning::Keep),
    ("ignore", "The pixel is ignored", MaskMeaning::Ignore),
];

/// `refraxel inspect`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel inspect my_photos
  refraxel inspect my_photos --out pictures
  refraxel inspect my_photos --set grid.resolution=384 --downscale 2
  refraxel inspect --devices
  refraxel inspect run --json")]
pub struct InspectArgs {
    /// A dataset's folder or file, or a run's folder
    #[arg(value_name = "PATH", required_unless_present = "devices")]
    pub path: Option<PathBuf>,
    /// List the GPUs of this machine instead, with their limits, features and memory
    #[arg(long, conflicts_with = "path")]
    pub devices: bool,
    /// Look at all photographs; write pictures of them, of the cameras, and of exposure and sharpness here
    ///
    /// inspect_photographs.png, inspect_cameras.png and inspect_views.png; those of an earlier call are replaced.
    /// Without it up to 200 photographs are looked at.
    #[arg(long, value_name = "DIR", conflicts_with = "devices")]
    pub out: Option<PathBuf>,
    /// Print the result as JSON on standard output, and nothing else there
    #[arg(long)]
    pub json: bool,
    /// The training whose memory is forecast.
    #[command(flatten)]
    pub training: ForecastArgs,
    /// How to read it.
    #[command(flatten)]
    pub reading: ReadingArgs,
}

/// Options of `refraxel train` that its memory depends on.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "The training whose memory is forecast, as for `refraxel train`")]
pub struct ForecastArgs {
    /// Whether rays bend
    #[arg(long, value_enum, default_value_t, value_name = "WHEN")]
    pub refraction: Refraction,
    /// Start from this index of refraction instead of masks
    #[arg(long, value_name = "FILE")]
    pub index_from: Option<PathBuf>,
    /// Change one training option (train --options lists them); may be repeated, the last one counts
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<Setting>,
    /// Read training options from a TOML file; --set overrides it
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Read the photographs with fewer pixels: 2 halves their edges, 1600 is the longer edge in pixels
    #[arg(long, value_name = "N|PIXELS")]
    pub downscale: Option<Reduction>,
}

/// Whether rays bend.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Refraction {
    /// All rays are straight
    Off,
    /// Rays bend where the best hypothesis about the glass says so, even if straight rays explain the photographs as well
    On,
    /// Rays bend where masks, a file or the detector show glass or water, unless straight rays explain the photographs as well
    #[default]
    Auto,
}

/// Whether something of the photographs learns.
const LEARNING: [(&str, &str, Switch); 2] = [
    ("fixed", "It stays as the data state it", Switch::Off),
    ("learn", "It learns, beginning with the value of the data", Switch::On),
];

/// `refraxel train`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel train my_photos --out run
  refraxel train glass --out run --refraction on --minutes 10
  refraxel train glass --out run --refraction-box -0.5,-0.5,0,0.5,0.5,1
  refraxel train my_photos --out run --poses learn
  refraxel train glass --out run --config quick.toml --set run.steps=2000 --set field.sh_degree=1
  refraxel train --options

Ctrl-C saves a checkpoint; the same command with --resume continues from it.")]
pub struct TrainArgs {
    /// The dataset's folder or file
    #[arg(value_name = "DATA", required_unless_present = "options")]
    pub data: Option<PathBuf>,
    /// Folder for the checkpoint, scores and pictures
    #[arg(long, value_name = "RUN", required_unless_present = "options")]
    pub out: Option<PathBuf>,
    /// Print all training options with their defaults, ranges and meanings, and do nothing else
    #[arg(long)]
    pub options: bool,
    /// With --options: print them as the page docs/options.md
    #[arg(long, requires = "options", conflicts_with = "json")]
    pub markdown: bool,
    /// Whether rays bend
    #[arg(long, value_enum, default_value_t, value_name = "WHEN")]
    pub refraction: Refraction,
    /// Box that holds everything refractive, in the units of the dataset; it limits the search, and does not replace masks
    #[arg(long, value_name = "X0,Y0,Z0,X1,Y1,Z1", allow_hyphen_values = true)]
    pub refraction_box: Option<String>,
    /// Whether sharp refractive surfaces also mirror their surroundings [default: on]
    #[arg(long, value_name = "WHETHER", value_parser = words(&ON_OFF))]
    pub reflection: Option<Switch>,
    /// Whether opaque things have a clearcoat that mirrors [default: off]
    #[arg(long, value_name = "WHETHER", value_parser = words(&ON_OFF))]
    pub clearcoat: Option<Switch>,
    /// Whether the poses of the photographs learn, too [default: fixed]
    ///
    /// Held-out photographs are then posed against the finished scene, by half of their own pixels.
    #[arg(long, value_name = "WHETHER", value_parser = words(&LEARNING))]
    pub poses: Option<Switch>,
    /// Whether focal length and first radial coefficient learn together with the poses [default: fixed]
    ///
    /// One pair for all photographs of a lens. Held-out photographs of it take its result.
    #[arg(long, value_name = "WHETHER", value_parser = words(&LEARNING))]
    pub lens: Option<Switch>,
    /// Whether exposure and white balance of the photographs learn, too [default: fixed]
    ///
    /// Renderings of held-out photographs are then exposed to match half of the pixels of these.
    #[arg(long, value_name = "WHETHER", value_parser = words(&LEARNING))]
    pub exposure: Option<Switch>,
    /// Start from this index of refraction instead of masks: a scene.json, an index volume, or a mesh
    ///
    /// A scene.json is exact and is held fixed; --set surface.rate=0.08 and --set index.rate=0.001 let it learn.
    #[arg(long, value_name = "FILE")]
    pub index_from: Option<PathBuf>,
    /// Change one training option (--options lists them); may be repeated, the last one counts
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<Setting>,
    /// Read training options from a TOML file; --set overrides it
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    /// Continue from the checkpoint in RUN, with its options
    #[arg(long, conflicts_with = "overwrite")]
    pub resume: bool,
    /// Replace the run that RUN holds, with its scores and curves
    #[arg(long)]
    pub overwrite: bool,
    /// Read the photographs with fewer pixels: 2 halves their edges, 1600 is the longer edge in pixels
    ///
    /// Pixels become means of the areas that they cover. Held-out photographs are reduced, too, and scored so.
    #[arg(long, value_name = "N|PIXELS")]
    pub downscale: Option<Reduction>,
    /// Aim for the best result within so many minutes of wall-clock time [default: a fixed number of steps, run.steps]
    #[arg(long, value_name = "M", value_parser = minutes)]
    pub minutes: Option<f64>,
    /// Show the training live in the browser, on any free port of 127.0.0.1 or on this one
    ///
    /// The address is printed on standard error. A page that is open costs training some of its time.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    pub view: Option<u16>,
    /// The device to train on: auto, cpu, gpu, or gpu:N as inspect --devices lists them
    ///
    /// auto is the CPU unless the program was built for GPUs, there is one, and it can do what the run needs. A run may continue
    /// on another device.
    #[arg(long, value_name = "DEVICE", default_value = "auto")]
    pub device: DeviceChoice,
    /// Start of the random numbers [default: 0]
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
    /// How to read it.
    #[command(flatten)]
    pub reading: ReadingArgs,
}

impl InspectArgs {
    /// The dataset or run; empty where devices are listed.
    pub fn path(&self) -> &Path {
        self.path.as_deref().unwrap_or(Path::new(""))
    }
}

impl TrainArgs {
    /// The dataset's folder or file; empty where options are only listed.
    pub fn data(&self) -> &Path {
        self.data.as_deref().unwrap_or(Path::new(""))
    }

    /// The run's folder; empty where options are only listed.
    pub fn out(&self) -> &Path {
        self.out.as_deref().unwrap_or(Path::new(""))
    }
}
