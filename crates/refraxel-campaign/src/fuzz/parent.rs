//! The process that starts workers, counts what they say, and keeps the files that they die of.

use super::worker::Cases;
use crate::targets::Target;
use anyhow::Context;
use serde::Serialize;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Address space of a worker [KiB]: more than any file of a few kilobytes may ask for.
const MEMORY: u64 = 4 << 20;
/// Workers that may die of one target before it is given up.
const DEATHS: usize = 20;

/// What the cases of one target showed.
#[derive(Debug, Default, Serialize)]
pub struct Tally {
    /// Its name.
    pub target: String,
    /// Files that were used, up to a trained, saved and rendered run.
    pub used: u64,
    /// Files that were refused with a message.
    pub refused: u64,
    /// The longest that a file took [s].
    pub slowest: f64,
    /// What must not be.
    pub findings: Vec<Found>,
}

/// A finding, and how to see it again.
#[derive(Debug, Serialize)]
pub struct Found {
    /// The number of its case.
    pub case: u64,
    /// One line.
    pub what: String,
    /// The file that shows it.
    pub file: PathBuf,
}

/// How workers are treated.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Where findings are kept.
    pub out: PathBuf,
    /// The longest that a case may take.
    pub patience: Duration,
}

/// Runs cases of a target in as many workers, one after the other, as it takes.
pub fn attack(target: &Target, cases: Cases, rules: &Rules) -> anyhow::Result<Tally> {
    let folder = tempfile::tempdir().context("cannot create a folder for the campaign")?;
    let mut tally = Tally { target: target.name.to_owned(), ..Tally::default() };
    let (start, mut next, end) = (Instant::now(), cases.from, cases.from.saturating_add(cases.count));
    for death in 0..=DEATHS {
        let left = cases.time.saturating_sub(start.elapsed());
        if next >= end || left.is_zero() {
            break;
        }
        let bench = folder.path().join(format!("worker-{death}"));
        let rest = Cases { from: next, count: end - next, time: left, ..cases };
        let mut worker = Worker::start(target, &bench, rest)?;
        let fate = worker.listen(&mut tally, rules.patience);
        let log = worker.end();
        keep_findings(&mut tally, &bench, rules)?;
        match fate {
            Fate::Ended => break,
            Fate::Lost { case: None, why } => anyhow::bail!("the worker of {} {why}: {log}", target.name),
            Fate::Lost { case: Some(case), why } => {
                let file = worker.file.clone().unwrap_or_default();
                let kept = keep(target.name, case, &file, rules)?;
                let what = format!("{why} {log}").trim().to_owned();
                tally.findings.push(Found { case, what, file: kept });
                next = case + 1;
            }
        }
    }
    Ok(tally)
}

/// Copies a file to where findings are kept.
fn keep(target: &str, case: u64, file: &Path, rules: &Rules) -> anyhow::Result<PathBuf> {
    let to = rules.out.join(target).join(case.to_string());
    fs::create_dir_all(rules.out.join(target))
        .with_context(|| format!("cannot create {}", rules.out.display()))?;
    fs::copy(file, &to).with_context(|| format!("cannot copy {} to {}", file.display(), to.display()))?;
    Ok(to)
}

fn keep_findings(tally: &mut Tally, bench: &Path, rules: &Rules) -> anyhow::Result<()> {
    for found in tally.findings.iter_mut().filter(|f| f.file.as_os_str().is_empty()) {
        found.file = keep(&tally.target, found.case, &bench.join(format!("finding-{}", found.case)), rules)?;
    }
    Ok(())
}

enum Fate {
    Ended,
    Lost { case: Option<u64>, why: String },
}

struct Worker {
    child: Child,
    lines: Receiver<String>,
    file: Option<PathBuf>,
    /// Lines that are not of the protocol: what a runtime says when it dies.
    other: Vec<String>,
}

impl Worker {
    fn start(target: &Target, bench: &Path, cases: Cases) -> anyhow::Result<Self> {
        let this = std::env::current_exe().context("cannot find this program")?;
        let script = format!("ulimit -c 0; ulimit -v {MEMORY} && exec \"$0\" \"$@\"");
        let numbers = [cases.seed, cases.from, cases.count].map(|n| n.to_string());
        let time = cases.time.as_secs_f64().to_string();
        let mut command = Command::new("sh");
        command.arg("-c").arg(script).arg(this).args(["worker", target.name, "--bench"]).arg(bench);
        command.args([
            "--seed",
            &numbers[0],
            "--from",
            &numbers[1],
            "--cases",
            &numbers[2],
            "--seconds",
            &time,
        ]);
        command
            .env("RAYON_NUM_THREADS", "1")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut child = command.spawn().context("cannot start a worker; the campaign needs `sh`")?;
        let (say, lines) = channel();
        let err = child.stderr.take().context("a worker without standard error")?;
        thread::spawn(move || {
            for line in BufReader::new(err).split(b'\n').map_while(Result::ok) {
                if say.send(String::from_utf8_lossy(&line).into_owned()).is_err() {
                    break;
                }
            }
        });
        Ok(Self { child, lines, file: None, other: Vec::new() })
    }

    /// Counts what the worker says until it ends, dies, or says nothing for too long.
    fn listen(&mut self, tally: &mut Tally, patience: Duration) -> Fate {
        let (mut under_way, mut since) = (None, Instant::now());
        loop {
            // Before its first case a worker trains; on a busy machine that takes long.
            let patience = if under_way.is_some() { patience } else { 10 * patience };
            let line = match self.lines.recv_timeout(patience) {
                Ok(line) => line,
                Err(RecvTimeoutError::Timeout) => {
                    let why = format!("no answer within {} s", patience.as_secs());
                    return Fate::Lost { case: under_way, why };
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Fate::Lost { case: under_way, why: self.death() };
                }
            };
            let (mark, rest) = line.split_once(' ').unwrap_or((&line, ""));
            let (number, what) = rest.split_once(' ').unwrap_or((rest, ""));
            let case = number.parse().ok();
            match (mark, case) {
                ("end", _) => return Fate::Ended,
                ("file", _) => self.file = Some(PathBuf::from(rest)),
                ("@", Some(case)) => (under_way, since) = (Some(case), Instant::now()),
                ("=" | "!", Some(case)) => {
                    under_way = None;
                    tally.slowest = tally.slowest.max(since.elapsed().as_secs_f64());
                    match (mark, what) {
                        ("=", "used") => tally.used += 1,
                        ("=", _) => tally.refused += 1,
                        _ => tally.findings.push(Found { case, what: what.to_owned(), file: PathBuf::new() }),
                    }
                }
                _ => self.other.push(line),
            }
        }
    }

    /// How the worker ended.
    fn death(&mut self) -> String {
        self.child.wait().map_or_else(|e| format!("vanished: {e}"), |status| format!("died: {status}"))
    }

    /// Ends the worker; gives its last words that were not of the protocol.
    fn end(&mut self) -> String {
        let _ = self.child.kill(); // it may have ended
        let _ = self.child.wait();
        let from = self.other.len().saturating_sub(3);
        self.other[from..].join(" / ")
    }
}
