//! `refraxel mask`.

use super::data::ReadingArgs;
use super::values::Setting;
use super::work::WorkArgs;
use clap::Args;
use std::path::PathBuf;

/// `refraxel mask`
#[derive(Args, Debug)]
#[command(after_help = "Examples:
  refraxel mask my_photos                finds all regions that straight rays cannot explain
  refraxel mask my_photos --click IMG_7.jpg 640 410
  refraxel mask my_photos --box IMG_7.jpg 520 300 790 600 --box IMG_31.jpg 410 280 700 640
  refraxel mask my_photos --outline IMG_7.jpg 530,310 780,320 760,590 550,580

VIEW is the name of a photograph, with or without its extension. X counts pixels from the left, Y from the top. Masks are PNG files, white \
where glass or water is seen first; correct them in any painting program, then train.")]
pub struct MaskArgs {
    /// The dataset's folder or file; views that have masks keep them, and these masks guide the search
    #[arg(value_name = "DATA")]
    pub data: PathBuf,
    /// A point of a photograph that shows glass or water; may be repeated
    #[arg(long, value_names = ["VIEW", "X", "Y"], num_args = 3, action = clap::ArgAction::Append)]
    pub click: Vec<String>,
    /// A box outside which a photograph shows neither glass nor water; may be repeated
    #[arg(long = "box", value_names = ["VIEW", "X0", "Y0", "X1", "Y1"], num_args = 5, action = clap::ArgAction::Append)]
    pub boxes: Vec<String>,
    /// The outline of glass or water in a photograph: a polygon of at least three points; may be repeated
    #[arg(long, value_names = ["VIEW", "X,Y"], num_args = 4.., action = clap::ArgAction::Append)]
    pub outline: Vec<String>,
    /// Folder for the masks [default: glass_masks in the dataset's folder]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Make all masks in that folder anew, instead of those that are missing
    #[arg(long)]
    pub overwrite: bool,
    /// Change one training option, such as detection.rays=5000000; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub settings: Vec<Setting>,
    /// Threads, progress, JSON.
    #[command(flatten)]
    pub work: WorkArgs,
    /// How to read it.
    #[command(flatten)]
    pub reading: ReadingArgs,
}
