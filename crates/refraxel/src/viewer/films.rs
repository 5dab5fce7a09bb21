//! Films of a run that its page asks for: `refraxel render` makes them, one at a time, in a process of its own.

use super::outgoing::{Out, Outgoing};
use super::protocol::{FilmFormat, FilmState, FilmWish, Shown, Tell};
use crate::locked::locked;
use crate::worker::{Ended, Heard, Pace, Worker};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A render that is asked to stop does so between two frames; nobody waits longer for it.
const PATIENCE: Duration = Duration::from_secs(5);

/// Renders films for the pages of a run.
#[derive(Clone, Debug)]
pub struct Films(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    program: PathBuf,
    run: PathBuf,
    /// Where films wait to be fetched.
    folder: PathBuf,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    worker: Option<Worker>,
    /// Removed with all that is in it when the program ends.
    kept: Option<TempDir>,
}

impl Films {
    /// Films of a run, in a temporary folder.
    pub fn of(run: &Path) -> io::Result<Self> {
        let folder = tempfile::Builder::new().prefix("refraxel-films-").tempdir()?;
        let (program, run) = (std::env::current_exe()?, std::path::absolute(run)?);
        let path = folder.path().to_owned();
        let state = Mutex::new(State { worker: None, kept: Some(folder) });
        Ok(Self(Arc::new(Inner { program, run, folder: path, state })))
    }

    /// The files that a film may have.
    pub(super) fn files(&self) -> [PathBuf; 3] {
        [FilmFormat::Mp4, FilmFormat::Webm, FilmFormat::Gif].map(|format| self.0.folder.join(format.file()))
    }

    /// Begins a film; the page is told how far it is. An error says why it cannot begin.
    pub(super) fn begin(&self, wish: &FilmWish, out: &Out) -> Result<(), String> {
        let mut state = locked(&self.0.state);
        if state.worker.is_some() {
            return Err("a film is rendered already; wait for it, or stop it".to_owned());
        }
        if state.kept.is_none() {
            return Err("the viewer ends".to_owned());
        }
        let path = self.0.folder.join("camera_path.json");
        fs::write(&path, &wish.path).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        let words = self.0.words(wish, &path);
        let tell = |state: FilmState| Outgoing::tell(&Tell::Film(state));
        let said = Arc::new(Mutex::new(String::new()));
        let (told, heard) = (out.clone(), Arc::clone(&said));
        let hear = move |line: Heard<'_>| {
            let Heard::Said(line) = line else { return };
            match Pace::of(line) {
                Some(pace) => told.send(tell(FilmState::Renders { pace: Some(pace) })),
                None => locked(&heard).push_str(&format!("{line}\n")),
            }
        };
        let (films, told, file) = (self.clone(), out.clone(), wish.format.file());
        let end = move |ended: Ended| {
            let worker = locked(&films.0.state).worker.take();
            told.send(tell(match ended.code {
                Some(0) => FilmState::Ready { file: file.to_owned() },
                _ if worker.is_some_and(|worker| worker.is_stopped()) => FilmState::Stopped,
                _ => FilmState::Failed { why: locked(&said).clone() },
            }));
        };
        let worker = Worker::start(&self.0.program, &words, &self.0.folder, hear, end);
        state.worker =
            Some(worker.map_err(|error| format!("cannot start {}: {error}", self.0.program.display()))?);
        out.send(tell(FilmState::Renders { pace: None }));
        Ok(())
    }

    /// Stops the film that is rendered.
    pub(super) fn stop(&self) {
        let worker = locked(&self.0.state).worker.clone();
        worker.iter().for_each(Worker::stop);
    }

    /// The program ends: what is rendered is stopped, and all films are removed.
    pub fn end(&self) {
        self.stop();
        let kept = locked(&self.0.state).kept.take();
        let (worker, until) = (locked(&self.0.state).worker.clone(), Instant::now() + PATIENCE);
        worker.iter().for_each(|worker| worker.wait_until(until));
        drop(kept);
    }
}

impl Inner {
    fn words(&self, wish: &FilmWish, path: &Path) -> Vec<String> {
        let shown = |path: &Path| path.display().to_string();
        let file = self.folder.join(wish.format.file());
        let words = [
            "render",
            &shown(&self.run),
            "--camera-path",
            &shown(path),
            "--out",
            &shown(&file),
            "--overwrite",
        ];
        let mut words: Vec<String> = words.map(str::to_owned).to_vec();
        words.extend(["--outputs".to_owned(), wish.shown.name().to_owned()]);
        match (wish.straight, wish.index) {
            (true, _) => words.extend(["--scale-index", "0"].map(str::to_owned)),
            (false, Some(index)) => words.extend(["--set-index".to_owned(), index.to_string()]),
            (false, None) => {}
        }
        words
    }
}

impl FilmFormat {
    /// The name of the file of a film.
    fn file(self) -> &'static str {
        match self {
            Self::Mp4 => "film.mp4",
            Self::Webm => "film.webm",
            Self::Gif => "film.gif",
        }
    }
}

impl Shown {
    /// Its name on the command line.
    fn name(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::Depth => "depth",
            Self::Opacity => "opacity",
            Self::Reflection => "reflection",
            Self::Transmission => "transmission",
            Self::Index => "index",
            Self::Normal => "normal",
        }
    }
}
