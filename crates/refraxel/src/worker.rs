//! A verb of this program in a process of its own: what it says, how far it is, and how it is stopped.

use crate::locked::locked;
use crate::shell::quoted;
use serde::Serialize;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Names the process that has started this one and shows what it says. A verb that is started so tells its progress more often, and ends
/// as by Ctrl-C when that process is gone.
const STARTED_BY: &str = "REFRAXEL_STARTED_BY";
/// How often a verb looks whether the process that has started it is there, and how often somebody waits for one.
const LOOK: Duration = Duration::from_millis(100);
/// What is kept of what a verb prints [byte].
const MOST_PRINTED: usize = 1 << 20;

/// A line of a verb.
#[derive(Clone, Copy, Debug)]
pub enum Heard<'a> {
    /// On standard error: progress, notes, and why it fails.
    Said(&'a str),
    /// On standard output: its result.
    Printed(&'a str),
}

/// How a verb has ended.
#[derive(Clone, Debug)]
pub struct Ended {
    /// The exit code; `None` where a signal has ended it.
    pub code: Option<i32>,
    /// Its standard output.
    pub printed: String,
}

/// A verb at work. Dropped, it goes on.
#[derive(Clone, Debug)]
pub struct Worker(Arc<Mutex<Running>>);

#[derive(Debug)]
struct Running {
    /// `None` once it has ended.
    child: Option<Child>,
    is_stopped: bool,
}

impl Worker {
    /// Starts `program` with the words of a verb in a folder. Its lines are `heard` as they come; `ended` is called when it has.
    pub fn start(
        program: &Path,
        words: &[String],
        folder: &Path,
        heard: impl Fn(Heard<'_>) + Send + Sync + 'static,
        ended: impl FnOnce(Ended) + Send + 'static,
    ) -> io::Result<Self> {
        let mut command = Command::new(program);
        command.args(words).current_dir(folder).env(STARTED_BY, std::process::id().to_string());
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C at a terminal goes to this program alone, which then stops the other once: a second signal would leave no time to save.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn()?;
        let (out, said) = (child.stdout.take(), child.stderr.take());
        let worker = Self(Arc::new(Mutex::new(Running { child: Some(child), is_stopped: false })));
        let (waiting, heard) = (worker.clone(), Arc::new(heard));
        let listening = Arc::clone(&heard);
        let listener = thread::spawn(move || lines(said, |line| listening(Heard::Said(line))));
        thread::spawn(move || {
            let mut printed = String::new();
            lines(out, |line| {
                if printed.len() + line.len() < MOST_PRINTED {
                    printed.push_str(line);
                    printed.push('\n');
                }
                heard(Heard::Printed(line));
            });
            let _ = listener.join();
            let code = waiting.wait().and_then(|status| status.code());
            ended(Ended { code, printed });
        });
        Ok(worker)
    }

    /// Asks the verb to stop, as Ctrl-C does: a training saves. Asked again, nothing more happens.
    pub fn stop(&self) {
        let mut running = locked(&self.0);
        if std::mem::replace(&mut running.is_stopped, true) {
            return;
        }
        if let Some(child) = &mut running.child {
            interrupt(child);
        }
    }

    /// Whether it was asked to stop.
    pub fn is_stopped(&self) -> bool {
        locked(&self.0).is_stopped
    }

    /// Waits for its end, no longer than `until`.
    pub fn wait_until(&self, until: Instant) {
        while locked(&self.0).child.is_some() && Instant::now() < until {
            thread::sleep(LOOK);
        }
    }

    /// All that it says is heard: it has ended, or does so now.
    fn wait(&self) -> Option<ExitStatus> {
        let mut running = locked(&self.0);
        let status = running.child.as_mut().and_then(|child| child.wait().ok());
        running.child = None;
        status
    }
}

#[cfg(unix)]
fn interrupt(child: &mut Child) {
    use nix::sys::signal::{Signal, kill};
    let id = i32::try_from(child.id()).unwrap_or(i32::MAX);
    let _ = kill(nix::unistd::Pid::from_raw(id), Signal::SIGINT); // it may have ended
}

/// There is no signal that another program could be sent: what was saved before stays.
#[cfg(not(unix))]
fn interrupt(child: &mut Child) {
    let _ = child.kill();
}

fn lines(stream: Option<impl Read>, mut each: impl FnMut(&str)) {
    let Some(stream) = stream else { return };
    for line in BufReader::new(stream).split(b'\n').map_while(Result::ok) {
        each(String::from_utf8_lossy(&line).trim_end());
    }
}

/// The command as people would type it.
pub fn typed(words: &[String]) -> String {
    let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    format!("refraxel {}", words.join(" "))
}

/// How far a verb is, from a line of its progress.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Pace {
    /// What it does.
    pub task: String,
    /// How much of that is done.
    pub percent: f64,
    /// The time left for that, such as 0:50, where it is known.
    pub left: Option<String>,
}

impl Pace {
    /// Reads lines such as `training 17 % 50/300  0:50 left  27.3 dB`.
    pub fn of(line: &str) -> Option<Self> {
        let (before, after) = line.split_once(" % ")?;
        let (task, percent) = before.rsplit_once(' ')?;
        let percent = percent.parse().ok().filter(|p| (0.0..=100.0).contains(p))?;
        let (done, total) = after.split(' ').next()?.split_once('/')?;
        [done, total].iter().all(|n| n.parse::<u64>().is_ok()).then_some(())?;
        let is_clock =
            |word: &&str| word.contains(':') && word.chars().all(|c| c.is_ascii_digit() || c == ':');
        let left = after.split_once(" left").and_then(|(time, _)| time.split(' ').next_back());
        Some(Self { task: task.to_owned(), percent, left: left.filter(is_clock).map(str::to_owned) })
    }
}

/// Whether another program has started this one and shows what it says.
pub fn is_shown_elsewhere() -> bool {
    std::env::var_os(STARTED_BY).is_some()
}

/// Calls `gone` when the process that has started this one is there no more.
#[cfg(unix)]
pub fn watch_starter(gone: impl FnOnce() + Send + 'static) {
    let starter = std::env::var(STARTED_BY).ok().and_then(|id| id.parse::<u32>().ok());
    let Some(starter) = starter else { return };
    thread::spawn(move || {
        while std::os::unix::process::parent_id() == starter {
            thread::sleep(LOOK);
        }
        gone();
    });
}

/// Nothing tells that here.
#[cfg(not(unix))]
pub fn watch_starter(_: impl FnOnce() + Send + 'static) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_progress_tell_task_share_and_time_left() {
        let pace = |task: &str, percent, left: Option<&str>| {
            Some(Pace { task: task.to_owned(), percent, left: left.map(str::to_owned) })
        };
        assert_eq!(
            Pace::of("training 17 % 50/300  0:50 left  27.3 dB"),
            pace("training", 17.0, Some("0:50"))
        );
        assert_eq!(
            Pace::of("index search 3 % 2/63  1:02:03 left"),
            pace("index search", 3.0, Some("1:02:03"))
        );
        assert_eq!(Pace::of("images 0 % 0/9  time left unknown"), pace("images", 0.0, None));
        for other in
            ["training started", "100 % sure", "note: 40 % of views", "hull 7 done in 0:12", "a 200 % b"]
        {
            assert_eq!(Pace::of(other), None, "{other}");
        }
    }

    #[test]
    fn commands_are_those_that_people_type() {
        let words = ["train", "my photos", "--out", "run"].map(str::to_owned);
        assert_eq!(typed(&words), "refraxel train 'my photos' --out run");
    }

    #[cfg(unix)]
    #[test]
    fn a_worker_is_heard_and_is_stopped_once() {
        use std::sync::mpsc::channel;
        let (sender, heard) = channel();
        let (end, ended) = channel();
        // It takes the first signal as this program does, and dies by the second.
        let script = "trap 'echo saves >&2; trap - INT; sleep 0.3; echo saved; exit 130' INT; echo \"$REFRAXEL_STARTED_BY\"; echo ready >&2; \
                      while :; do sleep 0.02; done";
        // A shell cannot trap what was ignored when it started, as in jobs that a script puts into the background.
        let (program, as_usual) = if cfg!(target_os = "linux") {
            ("/usr/bin/env", &["--default-signal=INT", "/bin/sh"][..])
        } else {
            ("/bin/sh", &[][..])
        };
        let words: Vec<String> =
            as_usual.iter().chain(&["-c", script]).map(|word| (*word).to_owned()).collect();
        let told = move |heard: Heard<'_>| {
            let _ = sender.send(format!("{heard:?}"));
        };
        let worker = Worker::start(Path::new(program), &words, Path::new("/"), told, move |ended| {
            let _ = end.send(ended);
        })
        .unwrap();
        let wait = Duration::from_secs(60);
        let mut first = [heard.recv_timeout(wait).unwrap(), heard.recv_timeout(wait).unwrap()];
        first.sort();
        assert_eq!(first, [format!("Printed(\"{}\")", std::process::id()), "Said(\"ready\")".to_owned()]);
        worker.stop();
        assert_eq!(heard.recv_timeout(wait).unwrap(), "Said(\"saves\")");
        worker.stop();
        let ended = ended.recv_timeout(wait).unwrap();
        assert_eq!((ended.code, ended.printed.lines().nth(1)), (Some(130), Some("saved")));
        worker.wait_until(Instant::now() + wait);
        assert!(locked(&worker.0).child.is_none(), "it has ended, and nobody waits for it any longer");
    }
}
