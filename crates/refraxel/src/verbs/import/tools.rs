//! Whether COLMAP and ffmpeg are there, and what they say of themselves and of a video.

use super::calls::Dialect;
use crate::exit::{Exit, Failure, OrExit};
use crate::shell::not_installed;
use anyhow::Context;
use std::io;
use std::path::Path;
use std::process::{Command, Stdio};

/// The COLMAP that is installed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colmap {
    /// Its first line, such as "COLMAP 3.8 -- …".
    pub version: String,
    pub dialect: Dialect,
}

/// The installed COLMAP: the program, else the Python module; `None` where there is neither on the PATH.
pub fn colmap() -> Result<Option<Colmap>, Failure> {
    let Some(general) = answer("colmap", &["-h"])? else { return pycolmap() };
    let help = answer("colmap", &["feature_extractor", "-h"])?.unwrap_or_default();
    let line = |text: &str| text.lines().find(|line| line.contains("COLMAP")).map(|l| l.trim().to_owned());
    let version = line(&general).or_else(|| line(&help)).unwrap_or_else(|| "COLMAP".to_owned());
    Ok(Some(Colmap { version, dialect: Dialect::of_help(&help) }))
}

fn pycolmap() -> Result<Option<Colmap>, Failure> {
    let said = answer("python3", &["-c", "import pycolmap; print('pycolmap', pycolmap.__version__)"])?;
    Ok(said.as_deref().and_then(pycolmap_of))
}

/// By what Python says; an error of an import is no version.
fn pycolmap_of(said: &str) -> Option<Colmap> {
    let has_number = |line: &&str| {
        line.strip_prefix("pycolmap ").is_some_and(|v| v.starts_with(|c: char| c.is_ascii_digit()))
    };
    let version = said.lines().map(str::trim).find(has_number)?.to_owned();
    Some(Colmap { version, dialect: Dialect::PYCOLMAP })
}

/// Whether ffmpeg and ffprobe, which comes with it, are on the PATH.
pub fn has_ffmpeg() -> Result<bool, Failure> {
    Ok(answer("ffmpeg", &["-version"])?.is_some() && answer("ffprobe", &["-version"])?.is_some())
}

/// What a video says of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Video {
    /// Length [second].
    pub seconds: f64,
    /// Mean frames per second.
    pub rate: f64,
}

/// Asks ffprobe about a video.
pub fn probe(video: &Path) -> Result<Video, Failure> {
    let shown = video.display().to_string();
    let entries = "stream=avg_frame_rate:format=duration";
    let words =
        ["-v", "error", "-select_streams", "v:0", "-show_entries", entries, "-of", "default=nw=1", &shown];
    let text = answer("ffprobe", &words)?.unwrap_or_default();
    parse_probe(&text).ok_or_else(|| {
        let said = text.trim().lines().next().unwrap_or("nothing").to_owned();
        let message = format!(
            "{shown}: ffprobe finds no video of known length in it (it says: {said}); give a video that ffmpeg can play"
        );
        Exit::BadInput.because(message)
    })
}

fn parse_probe(text: &str) -> Option<Video> {
    let value = |key: &str| text.lines().find_map(|l| l.trim().strip_prefix(key)?.strip_prefix('='));
    let seconds: f64 = value("duration")?.parse().ok()?;
    let (frames, per) = value("avg_frame_rate")?.split_once('/')?;
    let rate = frames.parse::<f64>().ok()? / per.parse::<f64>().ok()?;
    let is_positive = |v: f64| v.is_finite() && v > 0.0;
    (is_positive(seconds) && is_positive(rate)).then_some(Video { seconds, rate })
}

/// What a program prints; `None` where there is no such program.
fn answer(program: &str, words: &[&str]) -> Result<Option<String>, Failure> {
    match Command::new(program).args(words).stdin(Stdio::null()).output() {
        Ok(output) => {
            let both = [output.stdout, output.stderr].concat();
            Ok(Some(String::from_utf8_lossy(&both).into_owned()))
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error).with_context(|| format!("cannot start `{program}`")).or_exit(Exit::Io),
    }
}

/// The failure of an import without its programs: what is missing, how to install it, and the commands.
pub fn missing(names: &[&str], script: &[String]) -> Failure {
    let (is, it) = if names.len() == 1 { ("is", "it") } else { ("are", "them") };
    let module = match names.contains(&"COLMAP") {
        true => "\n  pip install pycolmap             (Python, takes the place of COLMAP)",
        false => "",
    };
    let text = format!(
        "{}{module}\nor run these commands where {it} {is} installed; they make such a dataset:\n  {}",
        not_installed(names),
        script.join("\n  "),
    );
    Exit::BadInput.because(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_video_says_its_length_and_rate() {
        let text = "avg_frame_rate=30000/1001\nduration=12.5\n";
        let video = parse_probe(text).unwrap();
        assert!((video.rate - 29.97).abs() < 1e-3 && video.seconds == 12.5);
        for text in ["", "duration=N/A\navg_frame_rate=25/1", "duration=3\navg_frame_rate=0/0"] {
            assert_eq!(parse_probe(text), None, "{text}");
        }
    }

    #[test]
    fn pycolmap_is_there_where_python_says_its_version() {
        let found = pycolmap_of("pycolmap 4.2.1\n").unwrap();
        assert_eq!((found.version.as_str(), found.dialect), ("pycolmap 4.2.1", Dialect::PYCOLMAP));
        let fault = "Traceback (most recent call last):\nModuleNotFoundError: No module named 'pycolmap'\n";
        assert_eq!((pycolmap_of(fault), pycolmap_of("")), (None, None));
    }

    #[test]
    fn missing_programs_come_with_installation_and_commands() {
        let text = missing(&["COLMAP", "ffmpeg"], &["colmap mapper".to_owned()]).report();
        for words in [
            "COLMAP and ffmpeg are not",
            "apt-get install colmap ffmpeg",
            "brew install",
            "pip install pycolmap",
            "colmap mapper",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
    }
}
