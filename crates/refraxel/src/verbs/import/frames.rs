//! Photographs from a video: evenly spread, and of neighbours the sharpest.

use super::calls::{self, Call};
use super::photos::FEWEST;
use super::sharp::sharpest;
use super::tools::{self, Video};
use super::work::{WorkFolder, remove};
use crate::exit::{Exit, Failure, OrExit};
use crate::shell::quoted_path;
use crate::verbs::files::create_folder;
use anyhow::Context;
use std::fs;
use std::path::{Path, PathBuf};

/// Frames that are compared for each photograph, at most: a third of a gap between photographs moves a camera little.
const GROUP: usize = 3;
/// Photographs that are taken unless the user says otherwise; docs/photographs.md advises 40 to 100.
pub const USUAL: usize = 80;
/// Stands for the rate where nobody can ask how long the video is.
const UNKNOWN: &str = "RATE";

/// Which frames of a video become photographs.
#[derive(Clone, Debug, PartialEq)]
pub struct Frames {
    pub video: PathBuf,
    /// Photographs to take.
    pub count: usize,
    /// Frames that are taken for each of them.
    group: usize,
    /// Frames per second that are taken, as ffmpeg reads it.
    rate: String,
}

impl Frames {
    /// So many photographs of a video, evenly spread; `None` where ffmpeg is not installed.
    pub fn of(video: &Path, count: usize, has_ffmpeg: bool) -> Result<Self, Failure> {
        let video = video.to_owned();
        if !has_ffmpeg {
            return Ok(Self { video, count, group: GROUP, rate: UNKNOWN.to_owned() });
        }
        let probed = tools::probe(&video)?;
        Self::evenly(video, count, probed)
    }

    fn evenly(video: PathBuf, count: usize, Video { seconds, rate }: Video) -> Result<Self, Failure> {
        let there = (seconds * rate).round() as usize;
        if there < FEWEST {
            let text = format!("{}: {there} frames; expected at least {FEWEST}", video.display());
            return Err(Exit::BadInput.because(text));
        }
        let count = count.min(there);
        let group = (there / count).clamp(1, GROUP);
        Ok(Self { video, count, group, rate: format!("{:.6}", (count * group) as f64 / seconds) })
    }

    /// The call that takes the frames.
    pub fn call(&self, work: &Path) -> Call {
        calls::frames(&self.video, work, self.count * self.group, &self.rate)
    }

    /// The same for a shell, which finds out the length of the video where that is not known.
    pub fn line(&self, work: &Path) -> String {
        let video = quoted_path(&self.video);
        let length =
            format!("$(ffprobe -v error -show_entries format=duration -of default=nw=1:nk=1 {video})");
        let rate = format!("\"fps={}/{length}\"", self.count * self.group);
        self.call(work).to_string().replace(&format!("fps={UNKNOWN}"), &rate)
    }

    /// True where an earlier import has taken the photographs.
    pub fn are_taken(work: &WorkFolder) -> bool {
        work.join("images").is_dir()
    }

    /// An empty folder for the frames.
    pub fn prepare(work: &WorkFolder) -> Result<(), Failure> {
        remove(&work.join("frames"))?;
        create_folder(&work.join("frames"))
    }

    /// Moves the sharpest frames to `images`, and removes the others.
    pub fn choose(&self, work: &WorkFolder) -> Result<(), Failure> {
        let taken = work.join("frames");
        let cannot = |path: &Path| format!("cannot read or move files of {}", path.display());
        let read = fs::read_dir(&taken).with_context(|| cannot(&taken)).or_exit(Exit::Io)?;
        let mut files: Vec<PathBuf> = read.flatten().map(|entry| entry.path()).collect();
        files.sort();
        let chosen = sharpest(&files, self.group)?;
        if chosen.len() < FEWEST {
            let text = format!(
                "{}: ffmpeg gave {} frames; expected {}",
                self.video.display(),
                chosen.len(),
                self.count
            );
            return Err(Exit::BadInput.because(text));
        }
        for file in files.iter().filter(|file| !chosen.contains(file)) {
            remove(file)?;
        }
        let images = work.join("images");
        fs::rename(&taken, &images).with_context(|| cannot(&taken)).or_exit(Exit::Io)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(count: usize, seconds: f64) -> Frames {
        Frames::evenly("walk.mp4".into(), count, Video { seconds, rate: 30.0 }).unwrap()
    }

    #[test]
    fn frames_are_spread_over_the_whole_video() {
        let frames = of(80, 20.0);
        assert_eq!((frames.count, frames.group, frames.rate.as_str()), (80, 3, "12.000000"));
        let words = frames.call(Path::new("w")).words;
        assert!(words.contains(&"fps=12.000000".to_owned()) && words.contains(&"240".to_owned()));
    }

    #[test]
    fn a_short_video_gives_the_frames_that_it_has() {
        let frames = of(80, 2.0);
        assert_eq!((frames.count, frames.group), (60, 1));
        assert!(Frames::evenly("a".into(), 80, Video { seconds: 0.05, rate: 30.0 }).is_err());
    }

    #[test]
    fn without_ffmpeg_a_shell_can_find_the_rate() {
        let line = Frames::of(Path::new("my walk.mp4"), 40, false).unwrap().line(Path::new("w"));
        assert!(
            line.contains("-vf \"fps=120/$(ffprobe -v error") && line.contains("'my walk.mp4')\""),
            "{line}"
        );
    }
}
