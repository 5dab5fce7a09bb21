//! The process that reads changed files. It may die of them; its parent then starts another one.
//!
//! It tells its parent on standard error, a line each: `@ CASE` before a case, `= CASE used|refused` and `! CASE WHAT` after it.
//! What a verb prints on standard output goes nowhere.

use super::{apply, changes, keep_panics, run_case};
use crate::targets::{Answer, Bench, Target};
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::time::{Duration, Instant};

/// Cases of one target.
#[derive(Clone, Copy, Debug)]
pub struct Cases {
    /// Seed of all cases.
    pub seed: u64,
    /// The first one.
    pub from: u64,
    /// How many at most.
    pub count: u64,
    /// For how long.
    pub time: Duration,
}

/// Runs cases in a folder. The shortest file that shows a finding stays there as `finding-CASE`.
pub fn run(target: &Target, folder: &Path, cases: Cases) -> anyhow::Result<()> {
    keep_panics();
    let bench = Bench::new(target, folder)?;
    let start = Instant::now();
    tell(&format!("file {}", bench.file().display()))?;
    for case in (cases.from..).take(usize::try_from(cases.count)?) {
        if start.elapsed() >= cases.time {
            break;
        }
        tell(&format!("@ {case}"))?;
        match run_case(target, &bench, &changes(target.name, cases.seed, case)) {
            Ok(Answer::Used) => tell(&format!("= {case} used"))?,
            Ok(_) => tell(&format!("= {case} refused"))?,
            Err(finding) => {
                let file = apply(target.format, bench.valid(), &finding.changes);
                fs::write(folder.join(format!("finding-{case}")), file)?;
                tell(&format!("! {case} {}", finding.what.replace('\n', " / ")))?;
            }
        }
    }
    tell("end")
}

fn tell(line: &str) -> anyhow::Result<()> {
    let mut err = io::stderr().lock();
    Ok(writeln!(err, "{line}")?)
}
