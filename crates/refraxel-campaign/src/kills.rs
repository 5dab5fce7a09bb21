//! Trainings that are killed and interrupted at random moments: every one goes on from a whole checkpoint, and ends with the
//! bits of a run that nobody disturbed.

use crate::training::{PATIENCE, Training, differences, glass_ball, leftovers, step};
use anyhow::{Context, ensure};
use refraxel_train::run::CHECKPOINT;
use serde::Serialize;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// So short that every phase of a run is met: the search, the step to finer grids, joint training. The clock of saves is fast: one in
/// 50 ms, so that kills meet saves.
const SETTINGS: [&str; 8] = [
    "run.steps=160",
    "run.batch=256",
    "run.save_every=0.05",
    "grid.resolution=32",
    "field.sh_degree=1",
    "straight_steps=40",
    "index_resolution=16",
    "environment_rows=8",
];
/// Exit code of a run that was interrupted and saved.
const INTERRUPTED: i32 = 130;

/// When it is enough.
#[derive(Clone, Copy, Debug)]
pub enum Enough {
    /// After so long.
    Time(Duration),
    /// After so many starts of a training: the same moments everywhere, as shares of an undisturbed run.
    Starts(u32),
}

/// What kills and signals have done.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Counts {
    /// Seed of the moments.
    pub seed: u64,
    /// `kill -9`.
    pub kills: u32,
    /// SIGINT and SIGTERM.
    pub signals: u32,
    /// Killed or interrupted before the first checkpoint.
    pub before_first_save: u32,
    /// Temporary files that killed programs left; the next start removes them.
    pub leftovers: usize,
    /// Runs that reached their end.
    pub finished: u32,
    /// Those with the bits of the undisturbed run.
    pub equal: u32,
    /// The longest from a signal to the end of the program [s].
    pub slowest_stop: f64,
    /// What must not be: a line each.
    pub failures: Vec<String>,
}

impl Counts {
    /// Nothing was lost, and something was tried.
    pub fn is_good(&self) -> bool {
        self.failures.is_empty() && self.kills > 0
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{} kills -9 and {} signals ({} before the first save), {} leftovers removed by the next start\n\
             {} runs finished, {} of them with the bits of the undisturbed run; longest stop {:.2} s\nfailures: {}",
            self.kills,
            self.signals,
            self.before_first_save,
            self.leftovers,
            self.finished,
            self.equal,
            self.slowest_stop,
            self.failures.len()
        );
        self.failures.iter().for_each(|f| text += &format!("\n  {f}"));
        text
    }
}

/// Kills and interrupts until it is enough; `out` keeps runs that show a failure.
pub fn run(program: &Path, seed: u64, enough: Enough, out: &Path) -> anyhow::Result<Counts> {
    let begin = Instant::now();
    let folder = tempfile::tempdir().context("cannot create a folder for the campaign")?;
    let data = folder.path().join("data");
    glass_ball(&data, 32, 24)?;
    let settings = SETTINGS.map(str::to_owned).to_vec();
    let training = Training { program: program.to_owned(), data, settings, threads: 1 };
    let reference = folder.path().join("undisturbed");
    let start = Instant::now();
    let mut undisturbed = training.start(&reference)?;
    ensure!(undisturbed.finish()?.success(), "the undisturbed run fails: {}", undisturbed.said());
    let length = start.elapsed().as_secs_f64();
    let mut random = fastrand::Rng::with_seed(seed);
    let mut counts = Counts { seed, ..Counts::default() };
    let run = folder.path().join("run");
    let mut starts = 0;
    while match enough {
        Enough::Time(time) => begin.elapsed() < time,
        Enough::Starts(most) => starts < most,
    } {
        starts += 1;
        let before = counts.failures.len();
        disturb(&training, &run, &reference, length, &mut random, &mut counts)?;
        if counts.failures.len() > before {
            let kept = out.join(format!("failure-{}", counts.failures.len()));
            fs::create_dir_all(out)?;
            let _ = fs::rename(&run, &kept); // another file system: the message must do
            let _ = fs::remove_dir_all(&run);
        }
    }
    if matches!(enough, Enough::Starts(_)) && run.exists() {
        // However few starts there were, the last run shows what came of them.
        let mut running = training.start(&run)?;
        match running.finish()? {
            ended if ended.success() => compare(&run, &reference, &mut counts)?,
            ended => counts.failures.push(format!("{ended}: {}", running.said())),
        }
    }
    Ok(counts)
}

/// One start, and its end by a kill, a signal, or itself.
fn disturb(
    training: &Training,
    run: &Path,
    reference: &Path,
    length: f64,
    random: &mut fastrand::Rng,
    counts: &mut Counts,
) -> anyhow::Result<()> {
    let had = run.join(CHECKPOINT).exists();
    let earlier = if had { step(run)? } else { 0 };
    let mut running = training.start(run)?;
    // Anywhere in a run, but more often early: while data are read, and right after a run went on.
    let moment = length * random.f64() * if random.f64() < 0.6 { 0.9 } else { 0.3 };
    let mut status = running.wait(Duration::from_secs_f64(moment))?;
    let signal = ["KILL", "KILL", "INT", "TERM"][random.usize(..4)];
    if status.is_none() {
        let sent = Instant::now();
        match signal {
            "KILL" => {
                counts.kills += 1;
                running.kill()?;
            }
            _ => {
                counts.signals += 1;
                running.send(signal)?;
                status = running.wait(PATIENCE)?;
                counts.slowest_stop = counts.slowest_stop.max(sent.elapsed().as_secs_f64());
                match status.map(|s| s.code()) {
                    None => counts.failures.push(format!("hangs after {signal}")),
                    Some(Some(0 | INTERRUPTED)) => {}
                    Some(code) => {
                        counts.failures.push(format!("code {code:?} after {signal}: {}", running.said()))
                    }
                }
            }
        }
    }
    let Some(ended) = status else {
        counts.leftovers += leftovers(run);
        return check(run, had, earlier, counts);
    };
    if leftovers(run) > 0 {
        counts.failures.push(format!("{} leftovers after an orderly end", leftovers(run)));
    }
    if !ended.success() {
        if ended.code() != Some(INTERRUPTED) {
            counts.failures.push(format!("{ended}: {}", running.said()));
        }
        return check(run, had, earlier, counts);
    }
    compare(run, reference, counts)
}

/// A run that is over has the bits of the undisturbed one.
fn compare(run: &Path, reference: &Path, counts: &mut Counts) -> anyhow::Result<()> {
    counts.finished += 1;
    match differences(reference, run)? {
        same if same.is_empty() => {
            counts.equal += 1;
            fs::remove_dir_all(run)?;
        }
        other => counts
            .failures
            .push(format!("other bits than those of the undisturbed run: {}", other.join(", "))),
    }
    Ok(())
}

/// What there was is there, whole, and not older.
fn check(run: &Path, had: bool, earlier: u64, counts: &mut Counts) -> anyhow::Result<()> {
    match (run.join(CHECKPOINT).exists(), had) {
        (false, true) => counts.failures.push("the checkpoint is gone".to_owned()),
        (false, false) => counts.before_first_save += 1,
        (true, _) => match step(run) {
            Err(error) => counts.failures.push(format!("the checkpoint cannot be read: {error}")),
            Ok(step) if step < earlier => counts.failures.push(format!("step {step} after step {earlier}")),
            Ok(_) => {}
        },
    }
    Ok(())
}
