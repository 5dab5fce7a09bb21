//! A verb that the start page has begun: its words, how far it is, and what came of it.

use super::folders::checked;
use crate::worker::{Ended, Heard, Pace, typed};
use refraxel_data::photographs::is_video;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};

/// Lines of a verb that are shown while it is at work, and those that are kept to say why it fails.
const SHOWN: usize = 6;
const KEPT: usize = 400;
/// How long a training may be [minute].
const MINUTES: [f64; 2] = [0.1, 10_000.0];
/// What `train` says before the address of its page.
const LIVE: &str = "live view: ";
/// Said of photographs whose poses have to be computed first, by the command that does so.
const NEEDS_POSES: &str = "refraxel import ";

/// A verb and its choices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "verb", rename_all = "snake_case", deny_unknown_fields)]
pub enum Task {
    /// Says what is in photographs with poses.
    Inspect {
        /// A folder or a file.
        path: String,
    },
    /// Computes the poses of photographs, or of those of a video.
    Import {
        /// A folder or a video.
        path: String,
    },
    /// Trains.
    Train {
        /// A folder or a file with poses.
        path: String,
        /// How long.
        minutes: f64,
        /// Whether rays bend.
        refraction: Refraction,
    },
}

/// Whether rays bend.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Refraction {
    /// As the program finds.
    Auto,
    /// In any case.
    On,
    /// In none.
    Off,
}

/// Where a verb stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// It is at work.
    Works,
    /// It was asked to stop, and saves.
    Stops,
    /// It has done what it should.
    Done,
    /// It has stopped as it was asked to.
    Stopped,
    /// It has failed.
    Failed,
}

/// A verb that is at work, or was last, as the page shows it.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Work {
    /// Counts those of this start of the program.
    pub number: u64,
    /// What was asked for.
    pub task: Task,
    /// The same as people would type it.
    pub command: String,
    /// The folder that it writes.
    pub out: Option<String>,
    /// Where it stands.
    pub stage: Stage,
    /// How far it is.
    pub pace: Option<Pace>,
    /// Its last lines, without those of its progress.
    #[cfg_attr(test, ts(as = "Vec<String>"))]
    pub lines: VecDeque<String>,
    /// Why it has failed or stopped, in full.
    pub why: Option<String>,
    /// The page of a training that is under way.
    pub live: Option<String>,
    /// What `inspect` or `import` has found, line by line.
    pub found: Option<String>,
    /// Poses have to be computed before anything else.
    pub needs_poses: bool,
    /// The folder of a run that can be looked at now.
    pub run: Option<String>,
    /// Everything that was said.
    #[serde(skip)]
    said: VecDeque<String>,
}

impl Work {
    /// A verb that begins in a folder, and the words of its command. An error says what is wrong with what was asked for.
    pub fn begin(
        number: u64,
        task: Task,
        folder: &Path,
        pictures: &Path,
        more: &[String],
    ) -> Result<(Self, Vec<String>), String> {
        let path = checked(task.path())?;
        if !path.exists() {
            return Err(format!("{}: there is no such folder or file", path.display()));
        }
        let path = text(&path)?;
        let out = match &task {
            Task::Inspect { .. } => None,
            Task::Import { .. } => Some(free_name(folder, &path, "scene")),
            Task::Train { .. } => Some(free_name(folder, &path, "run")),
        };
        let mut words = task.words(&path, out.as_deref(), pictures)?;
        if out.is_some() {
            words.extend(more.iter().cloned());
        }
        let work = Self {
            number,
            command: typed(&words),
            task,
            out: out.map(|out| folder.join(out).display().to_string()),
            stage: Stage::Works,
            pace: None,
            lines: VecDeque::new(),
            why: None,
            live: None,
            found: None,
            needs_poses: false,
            run: None,
            said: VecDeque::new(),
        };
        Ok((work, words))
    }

    /// Whether it is at work.
    pub fn is_at_work(&self) -> bool {
        matches!(self.stage, Stage::Works | Stage::Stops)
    }

    /// It says something; whether the page shows it.
    pub fn hear(&mut self, heard: Heard<'_>) -> bool {
        let Heard::Said(line) = heard else { return false };
        if let Some(url) = line.strip_prefix(LIVE) {
            self.live = Some(url.to_owned());
            return true;
        }
        if let Some(pace) = Pace::of(line) {
            self.pace = Some(pace);
            return true;
        }
        for (list, most) in [(&mut self.lines, SHOWN), (&mut self.said, KEPT)] {
            list.push_back(line.to_owned());
            if list.len() > most {
                list.pop_front();
            }
        }
        true
    }

    /// It has ended.
    pub fn end(&mut self, ended: &Ended) {
        let was_stopped = self.stage == Stage::Stops;
        (self.pace, self.live) = (None, None);
        self.stage = match ended.code {
            Some(0) => Stage::Done,
            _ if was_stopped => Stage::Stopped,
            _ => Stage::Failed,
        };
        if self.stage != Stage::Done {
            self.why = Some(self.complaint(ended));
        }
        let has_result = self.stage == Stage::Done && !matches!(self.task, Task::Train { .. });
        self.found = has_result.then(|| ended.printed.trim_end().to_owned());
        match &self.task {
            Task::Inspect { path } => {
                let complaint = self.why.as_deref().unwrap_or_default();
                self.needs_poses = self.stage == Stage::Failed
                    && (is_video(Path::new(path)) || complaint.contains(NEEDS_POSES));
            }
            Task::Import { .. } => {}
            Task::Train { .. } => {
                self.run = self.out.clone().filter(|run| super::runs::saved(Path::new(run)).is_some())
            }
        }
    }

    /// It cannot even begin.
    pub fn fail(&mut self, why: String) {
        (self.stage, self.why) = (Stage::Failed, Some(why));
    }

    /// From the message on by which it ends; all that it has said where there is none.
    fn complaint(&self, ended: &Ended) -> String {
        let start = self.said.iter().rposition(|line| line.starts_with("error: ")).unwrap_or(0);
        let lines: Vec<&str> = self.said.iter().skip(start).map(String::as_str).collect();
        match (lines.is_empty(), ended.code) {
            (false, Some(_)) => lines.join("\n"),
            (true, Some(code)) => format!("it has ended with exit code {code} and without a word"),
            // Linux does so where memory is short.
            (_, None) => {
                format!("{}\nit was ended by the system, as where memory is short", lines.join("\n"))
                    .trim()
                    .to_owned()
            }
        }
    }
}

impl Task {
    /// What it is about.
    pub fn path(&self) -> &str {
        match self {
            Self::Inspect { path } | Self::Import { path } | Self::Train { path, .. } => path,
        }
    }

    /// The words of its command; `out` is the name of the folder that it writes.
    fn words(&self, path: &str, out: Option<&str>, pictures: &Path) -> Result<Vec<String>, String> {
        let out = out.unwrap_or_default();
        let line = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect();
        Ok(match self {
            Self::Inspect { .. } => line(&["inspect", path, "--out", &text(pictures)?]),
            Self::Import { .. } => line(&["import", path, "--out", out]),
            Self::Train { minutes, refraction, .. } => {
                if !(MINUTES[0]..=MINUTES[1]).contains(minutes) {
                    let [low, high] = MINUTES;
                    return Err(format!("minutes: found {minutes}; expected {low} to {high}"));
                }
                let length = ["--minutes", &minutes.to_string()];
                let how = ["--refraction", refraction.name(), "--view"];
                line(&[&["train", path, "--out", out], &length[..], &how].concat())
            }
        })
    }
}

impl Refraction {
    /// The word of the command line.
    fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::On => "on",
            Self::Off => "off",
        }
    }
}

/// A path as a word of a command.
fn text(path: &Path) -> Result<String, String> {
    path.to_str().map(str::to_owned).ok_or_else(|| format!("{}: its name is no text", path.display()))
}

/// `NAME-KIND`, or with a number where that is there: nothing is replaced. `glass-scene` gives `glass-run`.
fn free_name(folder: &Path, path: &str, kind: &str) -> String {
    let path = Path::new(path);
    let name = if path.is_dir() { path.file_name() } else { path.file_stem() };
    let name = name.map_or_else(|| "photographs".into(), |name| name.to_string_lossy());
    let stem = name.strip_suffix("-scene").unwrap_or(&name).trim_start_matches('-');
    let stem = if stem.is_empty() { "photographs" } else { stem };
    let numbered = |k: usize| if k == 1 { format!("{stem}-{kind}") } else { format!("{stem}-{kind}-{k}") };
    let is_free = |name: &String| !PathBuf::from(folder).join(name).exists();
    (1..).map(numbered).find(is_free).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn train(path: &str, minutes: f64) -> Task {
        Task::Train { path: path.to_owned(), minutes, refraction: Refraction::Auto }
    }

    #[test]
    fn words_are_those_of_the_command_line_and_nothing_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        for name in ["my glass", "my glass-run", "a-scene"] {
            fs::create_dir(here.join(name)).unwrap();
        }
        let at = |name: &str| here.join(name).display().to_string();
        let threads = ["--threads", "1"].map(str::to_owned);
        let words = |task: Task| Work::begin(1, task, here, Path::new("/pictures"), &threads).unwrap();
        let (work, trained) = words(train(&at("my glass"), 2.5));
        let expected = format!(
            "refraxel train '{}' --out 'my glass-run-2' --minutes 2.5 --refraction auto --view --threads 1",
            at("my glass")
        );
        assert_eq!((work.command, trained.len()), (expected, 11));
        assert_eq!(work.out, Some(at("my glass-run-2")));
        assert_eq!(words(train(&at("a-scene"), 1.0)).0.out, Some(at("a-run")));
        let (inspected, _) = words(Task::Inspect { path: at("a-scene") });
        assert_eq!(inspected.command, format!("refraxel inspect {} --out /pictures", at("a-scene")));
        assert_eq!(words(Task::Import { path: at("a-scene") }).0.out, Some(at("a-scene-2")));
    }

    #[test]
    fn what_makes_no_sense_is_refused_before_anything_begins() {
        let refused =
            |task: Task| Work::begin(1, task, Path::new("/tmp"), Path::new("/p"), &[]).expect_err("refused");
        for (task, word) in [
            (train("photos", 1.0), "from the root"),
            (train("/tmp/../tmp", 1.0), "without \"..\""),
            (train("--out", 1.0), "from the root"),
            (train("/there/is/nothing", 1.0), "no such folder"),
            (train("/tmp", 0.0), "minutes: found 0"),
            (train("/tmp", f64::NAN), "minutes"),
            (Task::Inspect { path: "/nothing\0".to_owned() }, "no such folder"),
        ] {
            let why = refused(task.clone());
            assert!(why.contains(word), "{task:?}: {why}");
        }
    }

    fn at_work(task: Task) -> Work {
        Work::begin(1, task, Path::new("/tmp"), Path::new("/p"), &[]).unwrap().0
    }

    fn ended(code: Option<i32>, printed: &str) -> Ended {
        Ended { code, printed: printed.to_owned() }
    }

    #[test]
    fn progress_the_live_page_and_why_it_fails_are_told_apart() {
        let mut work = at_work(train("/tmp", 1.0));
        for line in
            ["note: one", "live view: http://127.0.0.1:1/ab/", "training 40 % 400/1000  0:36 left  20 dB"]
        {
            assert!(work.hear(Heard::Said(line)));
        }
        assert!(!work.hear(Heard::Printed("{")));
        assert_eq!((work.live.as_deref(), work.lines.len()), (Some("http://127.0.0.1:1/ab/"), 1));
        assert_eq!(work.pace.as_ref().map(|pace| pace.percent), Some(40.0));
        assert!((0..1000).all(|k| work.hear(Heard::Said(&format!("line {k}")))));
        assert_eq!((work.lines.len(), work.said.len()), (SHOWN, KEPT));
        work.hear(Heard::Said("error: no"));
        work.hear(Heard::Said("  because: of that"));
        work.end(&ended(Some(3), ""));
        assert_eq!(
            (work.stage, work.why.as_deref(), work.live),
            (Stage::Failed, Some("error: no\n  because: of that"), None)
        );
    }

    #[test]
    fn photographs_without_poses_and_videos_lead_to_the_import() {
        let inspect = |said: &str, code| {
            let mut work = at_work(Task::Inspect { path: "/tmp".to_owned() });
            assert!(said.lines().all(|line| work.hear(Heard::Said(line))));
            work.end(&ended(code, "x: nerfstudio\n"));
            work
        };
        assert!(
            inspect("error: p: 4 photographs without poses:\n  refraxel import p --out scene", Some(3))
                .needs_poses
        );
        assert!(!inspect("error: damaged", Some(3)).needs_poses);
        let done = inspect("", Some(0));
        assert_eq!((done.found.as_deref(), done.why, done.needs_poses), (Some("x: nerfstudio"), None, false));
        assert!(inspect("", None).why.unwrap().contains("ended by the system"));
    }

    #[test]
    fn a_stop_is_no_failure() {
        let mut work = at_work(train("/tmp", 1.0));
        work.stage = Stage::Stops;
        work.hear(Heard::Said("error: stopped at step 7 and saved"));
        work.end(&ended(Some(130), ""));
        assert_eq!(
            (work.stage, work.why.as_deref()),
            (Stage::Stopped, Some("error: stopped at step 7 and saved"))
        );
    }
}
