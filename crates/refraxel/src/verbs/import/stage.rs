//! One call of another program: its output goes to the log, its progress to the terminal, and Ctrl-C ends it. And what all
//! calls have given.

use super::calls::{Call, Stage, TOO_LITTLE};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Subtask, clock};
use crate::verbs::interrupts::interrupted;
use anyhow::Context;
use refraxel_data::ColmapModel;
use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time between two looks at the program and its log.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// Lines of the log that the message of a failure shows.
const SHOWN_LINES: usize = 15;

/// What the stages of an import have given.
#[derive(Default)]
pub(super) struct Done {
    pub(super) times: Vec<(Stage, Duration)>,
    /// The largest first.
    pub(super) models: Vec<ColmapModel>,
    pub(super) warnings: Vec<String>,
}

/// Runs the call to its end and returns how long it took. `log` is the path of the log.
///
/// Errors: [`Exit::BadInput`] with the last lines of the log when the program fails, [`Exit::Interrupted`] when the user
/// wants to stop.
pub fn run(call: &Call, log: &Path, progress: &mut Progress) -> Result<Duration, Failure> {
    let cannot_log = || format!("cannot write the log {}", log.display());
    let mut out = OpenOptions::new().append(true).open(log).with_context(cannot_log).or_exit(Exit::Io)?;
    writeln!(out, "\n$ {call}").with_context(cannot_log).or_exit(Exit::Io)?;
    let mut read = Tail::new(log)?;
    let copy = out.try_clone().with_context(cannot_log).or_exit(Exit::Io)?;
    let mut command = Command::new(call.program);
    command.args(&call.words).stdin(Stdio::null()).stdout(copy).stderr(out);
    let child =
        command.spawn().with_context(|| format!("cannot start `{}`", call.program)).or_exit(Exit::Io)?;
    let start = Instant::now();
    let status = wait(child, call, &mut read, |counted| {
        let name = call.stage.name();
        let note = clock(start.elapsed());
        progress.subtask(&Subtask { name, done: counted.done, total: counted.total }, &note);
    })?;
    if !status.success() {
        return Err(failed(call, status, log, &read.last_lines()));
    }
    Ok(start.elapsed())
}

fn wait(
    mut child: Child,
    call: &Call,
    read: &mut Tail,
    mut show: impl FnMut(Counted),
) -> Result<ExitStatus, Failure> {
    let mut counted = Counted::default();
    loop {
        let status = child.try_wait().with_context(|| format!("cannot wait for `{}`", call.program));
        let status = status.or_exit(Exit::Io)?;
        counted =
            read.lines().iter().filter_map(|line| count(call.stage, line)).next_back().unwrap_or(counted);
        show(counted);
        // Ctrl-C in a terminal reaches the program too, and it may end before this process has heard of it.
        if status.is_some_and(|status| !status.success()) {
            sleep(LOOK_EVERY);
        }
        if interrupted() {
            // Either may fail because Ctrl-C has ended the program already.
            let _ = child.kill();
            let _ = child.wait();
            return Err(Exit::Interrupted.because(format!("stopped while {} was at work", call.program)));
        }
        if let Some(status) = status {
            return Ok(status);
        }
        sleep(LOOK_EVERY);
    }
}

fn failed(call: &Call, status: ExitStatus, log: &Path, last: &str) -> Failure {
    let advice = match call.stage {
        Stage::Frames => "check that ffmpeg can play the video",
        _ if status.code().is_none() => {
            "it may have needed more memory than there is; try fewer or smaller photographs"
        }
        Stage::Poses => TOO_LITTLE,
        _ => "the log says why",
    };
    let text = format!(
        "{} failed at the {} ({status}); {advice}\n  {call}\nits last lines, of {}:\n{last}",
        call.program,
        call.stage.name(),
        log.display(),
    );
    Exit::BadInput.because(text)
}

/// What a program says it has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counted {
    done: u64,
    total: Option<u64>,
}

/// What a line of the log says about progress.
fn count(stage: Stage, line: &str) -> Option<Counted> {
    match stage {
        // "frame=  123 fps= 30 …"
        Stage::Frames => Some(Counted { done: number(line.strip_prefix("frame=")?)?, total: None }),
        // "Registering image #12 (34)", and "(num_reg_frames=34)" since 3.12
        Stage::Poses => {
            let (_, after) = line.split_once("Registering image #")?;
            let digits = after.split_once('(')?.1.trim_start_matches(|c: char| !c.is_ascii_digit());
            Some(Counted { done: number(digits)?, total: None })
        }
        // "Processed file [3/50]", "Matching image [3/50]", "Matching block [1/2, 2/2]"
        Stage::Features | Stage::Matches => {
            let (_, after) = line.split_once('[')?;
            let mut done = 0;
            let mut total = 1;
            for part in after.split_once(']')?.0.split(',') {
                let (at, of) = part.split_once('/')?;
                let (at, of) = (at.trim().parse::<u64>().ok()?, of.trim().parse::<u64>().ok()?);
                done = done * of + at.saturating_sub(1);
                total *= of;
            }
            // A file is named when it is done, pairs are when they begin.
            let is_done = u64::from(stage == Stage::Features);
            Some(Counted { done: done + is_done, total: Some(total) })
        }
        Stage::Refinement => None,
    }
}

/// The number at the beginning, after spaces.
fn number(text: &str) -> Option<u64> {
    let text = text.trim_start();
    text[..text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len())].parse().ok()
}

/// Reads a log while it grows.
struct Tail {
    file: File,
    /// Where this call began.
    start: u64,
    /// The beginning of a line that is not complete.
    rest: String,
}

impl Tail {
    /// Begins at the end of the log.
    fn new(log: &Path) -> Result<Self, Failure> {
        let cannot = || format!("cannot read the log {}", log.display());
        let mut file = File::open(log).with_context(cannot).or_exit(Exit::Io)?;
        let start = file.seek(SeekFrom::End(0)).with_context(cannot).or_exit(Exit::Io)?;
        Ok(Self { file, start, rest: String::new() })
    }

    /// Complete lines since the last look. A log that cannot be read shows no progress, which is no reason to stop.
    fn lines(&mut self) -> Vec<String> {
        let mut bytes = Vec::new();
        let _ = self.file.read_to_end(&mut bytes);
        self.rest += &String::from_utf8_lossy(&bytes);
        let Some(end) = self.rest.rfind(['\n', '\r']) else { return Vec::new() };
        let rest = self.rest.split_off(end + 1);
        let whole = std::mem::replace(&mut self.rest, rest);
        whole.split(['\n', '\r']).filter(|line| !line.is_empty()).map(str::to_owned).collect()
    }

    /// The last lines of the call, indented.
    fn last_lines(&mut self) -> String {
        let mut bytes = Vec::new();
        let read =
            self.file.seek(SeekFrom::Start(self.start)).and_then(|_| self.file.read_to_end(&mut bytes));
        let text = String::from_utf8_lossy(&bytes);
        let lines: Vec<&str> = text.split(['\n', '\r']).filter(|line| !line.trim().is_empty()).collect();
        match read {
            Ok(_) if !lines.is_empty() => {
                let last = &lines[lines.len().saturating_sub(SHOWN_LINES)..];
                last.iter().map(|line| format!("  | {line}")).collect::<Vec<_>>().join("\n")
            }
            _ => "  | (nothing)".to_owned(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counted(stage: Stage, line: &str) -> Option<(u64, Option<u64>)> {
        count(stage, line).map(|c| (c.done, c.total))
    }

    #[test]
    fn lines_of_the_programs_tell_their_progress() {
        assert_eq!(counted(Stage::Frames, "frame=  123 fps= 30 q=2.0"), Some((123, None)));
        assert_eq!(counted(Stage::Features, "Processed file [3/50]"), Some((3, Some(50))));
        let newer = "I20251107 12:00:00.1 7 feature_extraction.cc:258] Processed file [4/50]";
        assert_eq!(counted(Stage::Features, newer), Some((4, Some(50))));
        assert_eq!(counted(Stage::Matches, "Matching block [2/3, 1/3]"), Some((3, Some(9))));
        assert_eq!(counted(Stage::Matches, "Matching image [7/50] in 0.3s"), Some((6, Some(50))));
        assert_eq!(counted(Stage::Poses, "Registering image #12 (34)"), Some((34, None)));
        assert_eq!(counted(Stage::Poses, "Registering image #5 (num_reg_frames=3)"), Some((3, None)));
        for stage in [Stage::Frames, Stage::Features, Stage::Matches, Stage::Poses] {
            assert_eq!(counted(stage, "Elapsed time: 0.031 [minutes]"), None);
        }
    }
}
