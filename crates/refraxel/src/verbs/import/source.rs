//! Where the photographs of an import come from.

use super::frames::{self, Frames};
use super::photos::PhotoSet;
use super::tools;
use crate::cli::ImportArgs;
use crate::exit::{Exit, Failure};
use crate::verbs::dataset::data_failure;
use refraxel_data::DataError;
use refraxel_data::photographs::is_video;

/// Where the photographs come from.
pub(super) enum Source {
    Photographs(PhotoSet),
    Video(Frames),
}

impl Source {
    /// What the command line names, and whether ffmpeg is needed and missing.
    pub(super) fn of(args: &ImportArgs) -> Result<(Self, bool), Failure> {
        let path = &args.source;
        if !path.exists() {
            return Err(data_failure(DataError::NotFound { path: path.clone() }));
        }
        if path.is_dir() {
            if args.photographs.is_some() {
                return Err(
                    Exit::Usage.because("--photographs is for videos; of a folder all photographs are posed")
                );
            }
            return PhotoSet::of(args).map(|set| (Self::Photographs(set), false));
        }
        if !is_video(path) {
            let text = format!(
                "{} is neither a folder of photographs nor a video, such as .mp4 or .mov",
                path.display()
            );
            return Err(Exit::BadInput.because(text));
        }
        if args.masks.is_some() {
            let text = "--masks is for photographs; import the video, make masks of images in the result, and import \
                        those with --masks";
            return Err(Exit::Usage.because(text));
        }
        let has_ffmpeg = tools::has_ffmpeg()?;
        let count = args.photographs.map_or(frames::USUAL, |n| n as usize);
        Frames::of(path, count, has_ffmpeg).map(|frames| (Self::Video(frames), !has_ffmpeg))
    }
}
