//! Answers the start page: begins verbs, one at a time, and opens runs.

use super::folders;
use super::protocol::{Ask, Tell};
use super::runs::{recent, saved};
use super::task::{Stage, Task, Work};
use crate::locked::locked;
use crate::viewer::{Answerer, Out, Outgoing, Visitor};
use crate::worker::{Ended, Heard, Worker};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Runs that are open at a time; of more, the oldest is closed.
const MOST_SCENES: usize = 4;
/// Longest time that a verb gets to end after it was asked to: a training saves.
const PATIENCE: Duration = Duration::from_secs(120);
/// The pictures that `inspect` draws.
const PICTURES: [&str; 3] = ["inspect_photographs.png", "inspect_cameras.png", "inspect_views.png"];

/// What all threads of the start page share.
#[derive(Clone)]
pub struct Desk(Arc<Inner>);

struct Inner {
    program: PathBuf,
    /// The folder in which everything is written.
    folder: PathBuf,
    /// Where `inspect` draws; removed at the end.
    pictures: PathBuf,
    /// Words for verbs that take threads, and for those that show a run.
    threads: Vec<String>,
    renderer: Vec<String>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    pages: Vec<(u64, Out)>,
    work: Option<Work>,
    worker: Option<Worker>,
    /// Verbs that were begun.
    begun: u64,
    /// Runs that are open, the oldest first.
    scenes: Vec<Scene>,
    kept: Option<TempDir>,
    /// Nothing begins any more.
    has_ended: bool,
}

/// A run in a viewer of its own.
struct Scene {
    run: PathBuf,
    saved: Option<u64>,
    number: u64,
    worker: Option<Worker>,
    url: Option<String>,
    /// Pages that wait for the address.
    waiting: Vec<Out>,
    /// All that it has said.
    said: String,
}

impl Desk {
    /// A desk at which everything is written into `folder`.
    pub fn new(folder: PathBuf, threads: Vec<String>, renderer: Vec<String>) -> io::Result<Self> {
        let kept = tempfile::Builder::new().prefix("refraxel-start-").tempdir()?;
        let (program, pictures) = (std::env::current_exe()?, kept.path().to_owned());
        let state = Mutex::new(State { kept: Some(kept), ..State::default() });
        Ok(Self(Arc::new(Inner { program, folder, pictures, threads, renderer, state })))
    }

    /// Pictures that the page shows.
    pub fn pictures(&self) -> [PathBuf; 3] {
        PICTURES.map(|name| self.0.pictures.join(name))
    }

    /// The program ends: pages are told, what is at work stops, and a training is saved.
    pub fn end(&self, why: &str) {
        let (workers, kept) = {
            let mut state = locked(&self.0.state);
            state.has_ended = true;
            state.tell(&Tell::Ended { why: why.to_owned() });
            let scenes = state.scenes.iter().filter_map(|scene| scene.worker.clone());
            let workers: Vec<Worker> = state.worker.clone().into_iter().chain(scenes).collect();
            (workers, state.kept.take())
        };
        workers.iter().for_each(Worker::stop);
        let until = Instant::now() + PATIENCE;
        workers.iter().for_each(|worker| worker.wait_until(until));
        drop(kept);
    }

    fn answer(&self, ask: Ask, out: &Out) -> Result<(), String> {
        match ask {
            Ask::Runs => out.send(Outgoing::tell(&self.home())),
            Ask::Folder { path } => out.send(Outgoing::tell(&Tell::Folder(folders::list(&path)?))),
            Ask::Begin(task) => self.begin(task)?,
            Ask::Stop => self.stop(),
            Ask::Forget => {
                let mut state = locked(&self.0.state);
                state.work.take_if(|work| !work.is_at_work());
                state.tell_work();
            }
            Ask::Open { path } => {
                let run = folders::checked(&path)?;
                if saved(&run).is_none() {
                    return Err(format!("{path}: there is no run in this folder"));
                }
                self.open(&run, Some(out))?;
            }
        }
        Ok(())
    }

    fn home(&self) -> Tell {
        let folder = &self.0.folder;
        Tell::Home {
            folder: folder.display().to_string(),
            runs: recent(folder),
            places: folders::places(folder),
        }
    }

    /// Begins a verb where none is at work.
    fn begin(&self, task: Task) -> Result<(), String> {
        let mut state = locked(&self.0.state);
        if state.has_ended {
            return Err("the program ends".to_owned());
        }
        if let Some(work) = state.work.as_ref().filter(|work| work.is_at_work()) {
            return Err(format!("`{}` is at work; wait for it, or stop it", work.command));
        }
        let (folder, number) = (&self.0.folder, state.begun + 1);
        let (mut work, words) = Work::begin(number, task, folder, &self.0.pictures, &self.0.threads)?;
        state.begun = number;
        let (hearing, ending) = (self.clone(), self.clone());
        let hear = move |heard: Heard<'_>| hearing.hear(number, heard);
        let end = move |ended: Ended| ending.ended(number, &ended);
        match Worker::start(&self.0.program, &words, folder, hear, end) {
            Ok(worker) => state.worker = Some(worker),
            Err(error) => work.fail(format!("cannot start {}: {error}", self.0.program.display())),
        }
        state.work = Some(work);
        state.tell_work();
        Ok(())
    }

    fn hear(&self, number: u64, heard: Heard<'_>) {
        let mut state = locked(&self.0.state);
        let is_shown = state.work.as_mut().is_some_and(|work| work.number == number && work.hear(heard));
        if is_shown {
            state.tell_work();
        }
    }

    fn ended(&self, number: u64, ended: &Ended) {
        let mut state = locked(&self.0.state);
        state.worker = None;
        if let Some(work) = state.work.as_mut().filter(|work| work.number == number) {
            work.end(ended);
        }
        state.tell_work();
        let home = self.home();
        state.tell(&home);
    }

    fn stop(&self) {
        let mut state = locked(&self.0.state);
        state.worker.iter().for_each(Worker::stop);
        if let Some(work) = state.work.as_mut().filter(|work| work.is_at_work()) {
            work.stage = Stage::Stops;
        }
        state.tell_work();
    }

    /// Opens a run in a viewer of its own; whoever waits is told its address. One that is open and not older is shown again.
    fn open(&self, run: &Path, waiting: Option<&Out>) -> Result<(), String> {
        let mut state = locked(&self.0.state);
        if state.has_ended {
            return Err("the program ends".to_owned());
        }
        let now = saved(run);
        if let Some(scene) = state.scenes.iter_mut().find(|scene| scene.run == run && scene.saved == now) {
            match &scene.url {
                Some(url) => waiting.iter().for_each(|out| out.send(opened(url))),
                None => scene.waiting.extend(waiting.cloned()),
            }
            return Ok(());
        }
        state.begun += 1;
        let number = state.begun;
        let mut words = vec!["view".to_owned(), run.display().to_string(), "--json".to_owned()];
        words.extend(self.0.threads.iter().chain(&self.0.renderer).cloned());
        let (hearing, ending) = (self.clone(), self.clone());
        let hear = move |heard: Heard<'_>| hearing.hear_scene(number, heard);
        let end = move |_| ending.scene_ended(number);
        let worker = Worker::start(&self.0.program, &words, &self.0.folder, hear, end);
        let worker = worker.map_err(|error| format!("cannot start {}: {error}", self.0.program.display()))?;
        let waiting = waiting.cloned().into_iter().collect();
        let (run, worker) = (run.to_owned(), Some(worker));
        state.scenes.push(Scene { run, saved: now, number, worker, url: None, waiting, said: String::new() });
        if state.scenes.len() > MOST_SCENES {
            let oldest = state.scenes.remove(0);
            oldest.worker.iter().for_each(Worker::stop);
        }
        Ok(())
    }

    fn hear_scene(&self, number: u64, heard: Heard<'_>) {
        let mut state = locked(&self.0.state);
        let Some(scene) = state.scenes.iter_mut().find(|scene| scene.number == number) else { return };
        match heard {
            Heard::Said(line) => {
                scene.said.push_str(line);
                scene.said.push('\n');
            }
            Heard::Printed(line) => {
                let Some(url) = address(line) else { return };
                scene.waiting.drain(..).for_each(|out| out.send(opened(url)));
                scene.url = Some(url.to_owned());
            }
        }
    }

    fn scene_ended(&self, number: u64) {
        let mut state = locked(&self.0.state);
        let Some(k) = state.scenes.iter().position(|scene| scene.number == number) else { return };
        let scene = state.scenes.remove(k);
        let why = Outgoing::tell(&Tell::Refused { why: scene.said.trim_end().to_owned() });
        scene.waiting.iter().for_each(|out| out.send(why.clone()));
    }
}

impl State {
    fn tell(&self, tell: &Tell) {
        let told = Outgoing::tell(tell);
        self.pages.iter().for_each(|(_, out)| out.send(told.clone()));
    }

    fn tell_work(&self) {
        self.tell(&Tell::Work { work: self.work.clone() });
    }
}

impl Answerer for Desk {
    fn join(&self, page: &Visitor) -> bool {
        page.out.send(Outgoing::tell(&self.home()));
        let mut state = locked(&self.0.state);
        page.out.send(Outgoing::tell(&Tell::Work { work: state.work.clone() }));
        state.pages.push((page.id, page.out.clone()));
        true
    }

    fn take(&self, page: &Visitor, text: &str) -> Option<Outgoing> {
        let asked =
            serde_json::from_str(text).map_err(|error| format!("this question is not understood: {error}"));
        let refused = asked.and_then(|ask| self.answer(ask, &page.out)).err();
        refused.map(|why| Outgoing::tell(&Tell::Refused { why }))
    }

    fn leave(&self, page: &Visitor) {
        locked(&self.0.state).pages.retain(|(id, _)| *id != page.id);
    }
}

fn opened(url: &str) -> Outgoing {
    Outgoing::tell(&Tell::Opened { url: url.to_owned() })
}

/// The address in a line of `view --json`.
fn address(line: &str) -> Option<&str> {
    line.trim().strip_prefix("\"url\": \"")?.split('"').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_address_of_a_viewer_is_read_from_its_json() {
        let printed =
            serde_json::to_string_pretty(&serde_json::json!({ "url": "http://127.0.0.1:1/ab/" })).unwrap();
        let found: Vec<&str> = printed.lines().filter_map(address).collect();
        assert_eq!(found, ["http://127.0.0.1:1/ab/"]);
    }
}
