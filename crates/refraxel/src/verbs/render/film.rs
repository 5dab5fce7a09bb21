//! Films: frames go through ffmpeg as they are rendered; GIF needs no other program.

use crate::exit::{Exit, Failure, OrExit};
use crate::shell::not_installed;
use anyhow::Context;
use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbImage};
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::{self, JoinHandle};
use tempfile::{NamedTempFile, TempPath};

/// Colours of a GIF are sought in one of so many pixels: 1 is slowest and best, 30 fastest.
const GIF_SPEED: i32 = 10;

/// A kind of film.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// H.264 in MP4.
    Mp4,
    /// VP9 in WebM.
    Webm,
    /// GIF, 256 colours per frame.
    Gif,
}

impl Format {
    /// By the ending of a file; `None` for a folder. Films that are not written are refused with those that are.
    pub fn of(out: &Path) -> Result<Option<Self>, Failure> {
        if out.as_os_str().to_string_lossy().ends_with(std::path::is_separator) {
            return Ok(None); // the name of a folder
        }
        let Some(extension) = out.extension().and_then(|e| e.to_str()) else { return Ok(None) };
        match &*extension.to_lowercase() {
            "mp4" => Ok(Some(Self::Mp4)),
            "webm" => Ok(Some(Self::Webm)),
            "gif" => Ok(Some(Self::Gif)),
            other @ ("mov" | "mkv" | "avi" | "m4v") => {
                let named = out.display();
                Err(Exit::Usage
                    .because(format!("--out {named}: films are .mp4, .webm or .gif; found .{other}")))
            }
            _ => Ok(None),
        }
    }

    /// What ffmpeg makes of the frames.
    fn encoding(self) -> &'static [&'static str] {
        // Both codecs halve the resolution of colour, so that an odd row or column is left out.
        match self {
            Self::Mp4 => &[
                "-c:v",
                "libx264",
                "-crf",
                "18",
                "-preset",
                "medium",
                "-movflags",
                "+faststart",
                "-f",
                "mp4",
            ],
            Self::Webm => &["-c:v", "libvpx-vp9", "-crf", "28", "-b:v", "0", "-row-mt", "1", "-f", "webm"],
            Self::Gif => &[],
        }
    }
}

/// A film that is being written: under a temporary name until it is whole.
pub struct Film {
    out: PathBuf,
    size: [u32; 2],
    replaces: bool,
    /// Ends before its file is removed.
    encoder: Encoder,
    path: TempPath,
}

enum Encoder {
    Ffmpeg { child: Child, frames: Option<ChildStdin>, said: Option<JoinHandle<String>> },
    Gif { encoder: Box<GifEncoder<File>>, times: Times },
}

impl Film {
    /// Begins a film of frames of this size. Everything that can be wrong is found here: a file that is there already, a folder
    /// that cannot be written to, no ffmpeg.
    pub fn begin(
        out: &Path,
        format: Format,
        size: [u32; 2],
        fps: f64,
        overwrite: bool,
    ) -> Result<Self, Failure> {
        refuse_earlier(out, overwrite)?;
        let folder = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let cannot = || format!("cannot write {}", out.display());
        let (file, path) = temporary(folder).with_context(cannot).or_exit(Exit::Io)?.into_parts();
        let encoder = match format {
            Format::Gif => gif(file, Times::new(out, fps)?).with_context(cannot).or_exit(Exit::Io)?,
            Format::Mp4 | Format::Webm => ffmpeg(out, &path, format, size, fps)?,
        };
        Ok(Self { out: out.to_owned(), size, replaces: overwrite, encoder, path })
    }

    /// Adds a frame: three bytes per pixel, rows from the top.
    pub fn add(&mut self, pixels: Vec<u8>) -> Result<(), Failure> {
        let [width, height] = self.size;
        match &mut self.encoder {
            Encoder::Ffmpeg { frames, .. } => {
                let written = frames.as_mut().map_or(Ok(()), |frames| frames.write_all(&pixels));
                written.map_err(|_| self.why_not())
            }
            Encoder::Gif { encoder, times } => {
                let picture = RgbImage::from_raw(width, height, pixels).expect("three bytes per pixel");
                let picture = image::DynamicImage::ImageRgb8(picture).into_rgba8();
                let written = encoder.encode_frame(Frame::from_parts(picture, 0, 0, times.next_delay()));
                written.with_context(|| format!("cannot write {}", self.out.display())).or_exit(Exit::Io)
            }
        }
    }

    /// The film is whole: it gets its name.
    pub fn finish(mut self) -> Result<(), Failure> {
        if let Encoder::Ffmpeg { child, frames, .. } = &mut self.encoder {
            drop(frames.take());
            if !child.wait().is_ok_and(|status| status.success()) {
                return Err(self.why_not());
            }
        }
        let Self { out, path, encoder, replaces, .. } = self;
        drop(encoder); // a GIF ends with its encoder
        let cannot = || format!("cannot write {}", out.display());
        let synced = File::open(&path).and_then(|file| file.sync_all());
        synced.with_context(cannot).or_exit(Exit::Io)?;
        let named = if replaces { path.persist(&out) } else { path.persist_noclobber(&out) };
        named.with_context(cannot).or_exit(Exit::Io)
    }

    /// Why ffmpeg takes no more frames.
    fn why_not(&mut self) -> Failure {
        let Encoder::Ffmpeg { child, frames, said } = &mut self.encoder else {
            return Exit::Io.because(format!("cannot write {}", self.out.display()));
        };
        drop(frames.take());
        let _ = child.wait();
        let said = said.take().and_then(|said| said.join().ok()).unwrap_or_default();
        let last =
            said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("nothing").trim().to_owned();
        let out = self.out.display();
        Exit::Io.because(format!(
            "ffmpeg cannot make {out}; it says: {last}; a .gif needs no ffmpeg, and a folder as --out gets the frames"
        ))
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        if let Self::Ffmpeg { child, .. } = self {
            let _ = child.kill(); // no harm where it has ended
            let _ = child.wait();
        }
    }
}

/// When the frames of a GIF are shown: it counts hundredths of a second, so that roundings are carried on.
struct Times {
    fps: f64,
    shown: u32,
}

impl Times {
    /// Programs show frames of less than two hundredths of a second slowly.
    const FASTEST: f64 = 50.0;

    fn new(out: &Path, fps: f64) -> Result<Self, Failure> {
        if fps > Self::FASTEST {
            let shown = out.display();
            return Err(Exit::Usage.because(format!(
                "{shown}: found {fps} frames per second; a GIF has at most {}",
                Self::FASTEST
            )));
        }
        Ok(Self { fps, shown: 0 })
    }

    fn next_delay(&mut self) -> Delay {
        let end = |frames: u32| (100.0 * f64::from(frames) / self.fps).round() as u32;
        let hundredths = end(self.shown + 1) - end(self.shown);
        self.shown += 1;
        Delay::from_numer_denom_ms(10 * hundredths, 1)
    }
}

/// A file that others may read, as far as the system's mask allows.
fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".refraxel-film-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder)
}

fn refuse_earlier(out: &Path, overwrite: bool) -> Result<(), Failure> {
    let shown = out.display();
    let why = match out.symlink_metadata() {
        Ok(found) if found.is_dir() => {
            format!("--out {shown} is a folder; give the name of a film, or another folder")
        }
        Ok(_) if !overwrite => {
            format!("{shown} is there already; give another --out, or --overwrite to replace it")
        }
        _ => return Ok(()),
    };
    Err(Exit::BadInput.because(why))
}

fn gif(file: File, times: Times) -> io::Result<Encoder> {
    // Not buffered: what a full disk refuses is noticed with the frame.
    let mut encoder = GifEncoder::new_with_speed(file, GIF_SPEED);
    encoder.set_repeat(Repeat::Infinite).map_err(io::Error::other)?;
    Ok(Encoder::Gif { encoder: Box::new(encoder), times })
}

fn ffmpeg(out: &Path, path: &Path, format: Format, size: [u32; 2], fps: f64) -> Result<Encoder, Failure> {
    let [width, height] = size;
    let mut command = Command::new("ffmpeg");
    command.args(["-hide_banner", "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"]);
    command.args(["-s", &format!("{width}x{height}"), "-r", &fps.to_string(), "-i", "-"]);
    command.args(["-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p"]);
    command.args(format.encoding()).arg(path);
    // Ctrl-C at a terminal goes to this program alone, which then ends it.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let spawned = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    let mut child = match spawned {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(missing(out)),
        spawned => spawned.context("cannot start `ffmpeg`").or_exit(Exit::Io)?,
    };
    let frames = child.stdin.take();
    let said = child.stderr.take().map(|mut stderr| {
        thread::spawn(move || {
            let mut text = Vec::new();
            let _ = stderr.read_to_end(&mut text); // what is there is told
            String::from_utf8_lossy(&text).into_owned()
        })
    });
    Ok(Encoder::Ffmpeg { child, frames, said })
}

fn missing(out: &Path) -> Failure {
    let (film, folder) = (out.display(), out.with_extension(""));
    let folder = folder.display();
    Exit::BadInput.because(format!(
        "--out {film}: {}\n\
         or give a .gif, which needs none, or a folder for the frames, and make the film where ffmpeg is:\n  \
         ffmpeg -i {folder}/%04d.png -pix_fmt yuv420p {film}",
        not_installed(&["ffmpeg"])
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endings_say_what_is_written() {
        let of = |name: &str| Format::of(Path::new(name)).unwrap();
        assert_eq!(of("x/orbit.mp4"), Some(Format::Mp4));
        assert_eq!((of("a.WEBM"), of("b.gif")), (Some(Format::Webm), Some(Format::Gif)));
        assert_eq!((of("views.d"), of("views"), of("x.gif/")), (None, None, None));
        let refused = Format::of(Path::new("x.mov")).unwrap_err();
        assert_eq!(refused.exit, Exit::Usage);
        assert!(refused.report().contains(".mp4, .webm or .gif"), "{}", refused.report());
    }

    #[test]
    fn the_frames_of_a_gif_keep_time() {
        let mut times = Times::new(Path::new("x.gif"), 24.0).unwrap();
        let hundredths = |delay: Delay| delay.numer_denom_ms().0 / delay.numer_denom_ms().1 / 10;
        let delays: Vec<u32> = (0..48).map(|_| hundredths(times.next_delay())).collect();
        assert_eq!(delays.iter().sum::<u32>(), 200, "two seconds");
        assert!(delays.iter().all(|d| (4..=5).contains(d)), "{delays:?}");
        assert!(Times::new(Path::new("x.gif"), 60.0).is_err());
    }

    #[test]
    fn without_ffmpeg_there_is_another_way() {
        let text = missing(Path::new("x/orbit.mp4")).report();
        for words in ["apt-get install ffmpeg", ".gif", "ffmpeg -i x/orbit/%04d.png"] {
            assert!(text.contains(words), "{words}: {text}");
        }
    }

    #[test]
    fn a_film_without_its_end_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("film.gif");
        let mut film = Film::begin(&out, Format::Gif, [4, 2], 10.0, false).unwrap();
        film.add(vec![7; 24]).unwrap();
        drop(film);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let mut film = Film::begin(&out, Format::Gif, [4, 2], 10.0, false).unwrap();
        film.add(vec![7; 24]).unwrap();
        film.finish().unwrap();
        assert!(image::load_from_memory(&std::fs::read(&out).unwrap()).is_ok());
        let mut late = Film::begin(&folder.path().join("b.gif"), Format::Gif, [4, 2], 10.0, false).unwrap();
        late.add(vec![7; 24]).unwrap();
        std::fs::write(folder.path().join("b.gif"), "somebody else's").unwrap();
        assert!(late.finish().is_err(), "what came meanwhile stays");
        let again = Film::begin(&out, Format::Gif, [4, 2], 10.0, false).err().expect("refused");
        assert!(again.report().contains("--overwrite"), "{}", again.report());
        assert!(Film::begin(&out, Format::Gif, [4, 2], 10.0, true).is_ok());
    }
}
