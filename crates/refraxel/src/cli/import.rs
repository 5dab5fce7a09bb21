//! `refraxel import`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use refraxel_data::MaskMeaning;

use super::data::WHITE_MEANS;
use super::values::words;
use super::work::WorkArgs;

/// Which photographs are compared with each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Matching {
    /// Every pair; the time grows with the square of their number
    Exhaustive,
    /// Those that follow each other by name, as in a video
    Sequential,
}

/// `refraxel import`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel import photos --out scene
  refraxel import photos --out scene --masks glass_masks
  refraxel import walk.mp4 --out scene --photographs 60
  refraxel import photos --out scene --dry-run

It runs COLMAP, and ffmpeg for a video, which have to be installed:
apt-get install colmap ffmpeg (Debian, Ubuntu) or brew install colmap ffmpeg (macOS).
Ctrl-C keeps what is done; the same command continues from there.")]
pub struct ImportArgs {
    /// A folder of photographs (JPEG, PNG), or a video
    #[arg(value_name = "PHOTOS|VIDEO")]
    pub source: PathBuf,
    /// Folder for the dataset, which `train` opens
    #[arg(long, value_name = "DATA")]
    pub out: PathBuf,
    /// Folder of masks, NAME.png for each photograph; features on glass are not used for poses
    ///
    /// [default: glass_masks or masks in the folder of the photographs or beside it, if there is one]
    #[arg(long, value_name = "FOLDER")]
    pub masks: Option<PathBuf>,
    /// The meaning of white in the masks [default: by the name of their folder, else by comparing neighbouring photographs]
    #[arg(long, value_name = "MEANING", value_parser = words(&WHITE_MEANS))]
    pub mask_meaning: Option<MaskMeaning>,
    /// Photographs to take from a video, evenly spread, the sharpest of neighbours [default: 80]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(3..=10_000))]
    pub photographs: Option<u32>,
    /// Which photographs are compared [default: exhaustive up to 200 photographs; sequential beyond, and for videos]
    #[arg(long, value_enum, value_name = "HOW")]
    pub matching: Option<Matching>,
    /// Replace the imported dataset that DATA holds
    #[arg(long)]
    pub overwrite: bool,
    /// Print the commands that would be run, and do nothing else
    #[arg(long)]
    pub dry_run: bool,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
}
