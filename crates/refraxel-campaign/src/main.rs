//! The `campaign` program; `just campaign` runs it. docs/reliability.md says what it does.

use anyhow::{Context, ensure};
use clap::{Args, Parser, Subcommand};
use refraxel_campaign::fuzz::parent::{Rules, Tally, attack};
use refraxel_campaign::fuzz::worker::{self, Cases};
use refraxel_campaign::fuzz::{ask, keep_panics};
use refraxel_campaign::kills::{self, Enough};
use refraxel_campaign::soak::{self, SoakArgs};
use refraxel_campaign::targets::{self, Answer, Bench, Target};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::thread;
use std::time::Duration;

/// Attacks refraxel with damaged files, kills and signals. Exit code 1: something was found.
#[derive(Parser)]
#[command(after_help = "Examples:
  campaign fixed                      a fixed list of everything, a minute or two: what CI runs
  campaign all 3                      a short run of everything, 3 minutes
  campaign fuzz --seconds 600         mutated and hostile files
  campaign fuzz --only obj --seed 7   one format
  campaign replay obj case.obj        give one file to a target
  campaign replay-all                 all stored regression inputs
  campaign kills --seconds 300        kill -9, SIGINT and SIGTERM at random moments
  campaign soak --minutes 60          memory and bits of a long run")]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Everything for so many minutes: stored inputs, mutated files for half of the time, kills for the other half
    All {
        /// Time in all [minute]
        minutes: f64,
        #[command(flatten)]
        common: Common,
    },
    /// A fixed list: stored inputs, so many cases of each target, so many starts of trainings that are killed and interrupted
    Fixed {
        /// Cases of each target
        #[arg(long, default_value_t = 10)]
        cases: u64,
        /// Starts of trainings
        #[arg(long, default_value_t = 8)]
        starts: u32,
        #[command(flatten)]
        common: Common,
    },
    /// Changes valid files at random and gives them to the reader of each format
    Fuzz {
        /// Time in all [second]
        #[arg(long, default_value_t = 60.0)]
        seconds: f64,
        /// Cases of each target at most
        #[arg(long, default_value_t = u64::MAX)]
        cases: u64,
        /// The first case
        #[arg(long, default_value_t = 0)]
        from: u64,
        /// Only these targets, separated by commas
        #[arg(long, value_delimiter = ',')]
        only: Vec<String>,
        #[command(flatten)]
        common: Common,
    },
    /// Gives one file to a target
    Replay {
        /// The target
        target: String,
        /// The file
        file: PathBuf,
    },
    /// Gives all stored files to their targets
    ReplayAll {
        /// Where they are: FOLDER/TARGET/NAME
        #[arg(long, default_value = concat!(env!("CARGO_MANIFEST_DIR"), "/regressions"))]
        folder: PathBuf,
    },
    /// Kills and interrupts trainings, resumes them and compares the bits
    Kills {
        /// Time in all [second]
        #[arg(long, default_value_t = 60.0)]
        seconds: f64,
        #[command(flatten)]
        common: Common,
    },
    /// Trains for long, undisturbed and then interrupted at random moments: memory over time, and the bits at the end
    Soak(SoakArgs),
    /// Lists the targets
    Targets,
    /// The process that reads files
    #[command(hide = true)]
    Worker {
        target: String,
        #[arg(long)]
        bench: PathBuf,
        #[arg(long)]
        seed: u64,
        #[arg(long)]
        from: u64,
        #[arg(long)]
        cases: u64,
        #[arg(long)]
        seconds: f64,
    },
}

#[derive(Args, Clone)]
struct Common {
    /// Seed of all that is random
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for findings and reports
    #[arg(long, default_value = "campaign")]
    out: PathBuf,
    /// Processes at once
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// The refraxel program [default: the one beside this program]
    #[arg(long)]
    program: Option<PathBuf>,
}

/// The longest that a file may take; a busy machine must not look like a hang.
const PATIENCE: Duration = Duration::from_secs(180);
/// Time of cases that are counted [s].
const UNBOUNDED: f64 = 1e6;

fn main() -> anyhow::Result<()> {
    match Cli::parse().verb {
        Verb::All { minutes, common } => {
            replay_all(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/regressions")))?;
            let half = 30.0 * minutes;
            let fuzzed = fuzz(targets::all(), half, [0, u64::MAX], &common);
            let killed = kill(Enough::Time(Duration::from_secs_f64(half)), &common);
            fuzzed.and(killed)
        }
        Verb::Fixed { cases, starts, common } => {
            replay_all(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/regressions")))?;
            let fuzzed = fuzz(targets::all(), UNBOUNDED, [0, cases], &common);
            let killed = kill(Enough::Starts(starts), &common);
            fuzzed.and(killed)
        }
        Verb::Fuzz { seconds, cases, from, only, common } => {
            let chosen = only.iter().map(|name| targets::named(name)).collect::<anyhow::Result<Vec<_>>>()?;
            fuzz(if only.is_empty() { targets::all() } else { chosen }, seconds, [from, cases], &common)
        }
        Verb::Replay { target, file } => replay(&targets::named(&target)?, &[file]),
        Verb::ReplayAll { folder } => replay_all(&folder),
        Verb::Kills { seconds, common } => kill(Enough::Time(Duration::from_secs_f64(seconds)), &common),
        Verb::Soak(args) => soak::run(&args),
        Verb::Targets => targets::all().iter().try_for_each(|t| say(t.name)),
        Verb::Worker { target, bench, seed, from, cases, seconds } => {
            let cases = Cases { seed, from, count: cases, time: Duration::from_secs_f64(seconds) };
            worker::run(&targets::named(&target)?, &bench, cases)
        }
    }
}

fn say(line: &str) -> anyhow::Result<()> {
    Ok(writeln!(io::stdout(), "{line}")?)
}

/// Attacks targets, some at once, each for its share of the time.
fn fuzz(targets: Vec<Target>, seconds: f64, [from, count]: [u64; 2], common: &Common) -> anyhow::Result<()> {
    let share = seconds * common.jobs as f64 / targets.len() as f64;
    let cases = Cases { seed: common.seed, from, count, time: Duration::from_secs_f64(share) };
    let rules = Rules { out: common.out.join("findings"), patience: PATIENCE };
    let (queue, tallies) = (Mutex::new(targets.iter()), Mutex::new(Vec::new()));
    let next = || queue.lock().unwrap_or_else(|e| e.into_inner()).next();
    thread::scope(|scope| {
        for _ in 0..common.jobs {
            scope.spawn(|| {
                while let Some(target) = next() {
                    let done = attack(target, cases, &rules);
                    let _ = writeln!(io::stderr(), "{}", progress(target, &done)); // nowhere else to complain
                    tallies.lock().unwrap_or_else(|e| e.into_inner()).push(done);
                }
            });
        }
    });
    let tallies = tallies.into_inner().unwrap_or_else(|e| e.into_inner());
    let (done, failed): (Vec<_>, Vec<_>) = tallies.into_iter().partition(Result::is_ok);
    let mut tallies: Vec<Tally> = done.into_iter().flatten().collect();
    tallies.sort_by(|a, b| a.target.cmp(&b.target));
    tell(&tallies, common)?;
    fs::create_dir_all(&common.out).with_context(|| format!("cannot create {}", common.out.display()))?;
    fs::write(common.out.join("fuzz.json"), serde_json::to_string_pretty(&tallies)?)?;
    failed.into_iter().collect::<anyhow::Result<Vec<Tally>>>()?;
    let found: usize = tallies.iter().map(|t| t.findings.len()).sum();
    ensure!(found == 0, "{found} findings; their files are in {}", rules.out.display());
    Ok(())
}

/// What one target has shown, as soon as it is done.
fn progress(target: &Target, done: &anyhow::Result<Tally>) -> String {
    match done {
        Ok(t) => {
            format!("{}: {} used, {} refused, {} findings", t.target, t.used, t.refused, t.findings.len())
        }
        Err(error) => format!("{}: {error:#}", target.name),
    }
}

fn tell(tallies: &[Tally], common: &Common) -> anyhow::Result<()> {
    say(&format!("{:22}{:>9}{:>9}{:>10}{:>11}", "target", "used", "refused", "findings", "slowest"))?;
    let line = |name: &str, [used, refused, found]: [u64; 3], slowest: f64| {
        say(&format!("{name:22}{used:>9}{refused:>9}{found:>10}{slowest:>9.2} s"))
    };
    let mut sum = ([0; 3], 0.0_f64);
    for t in tallies {
        let counts = [t.used, t.refused, t.findings.len() as u64];
        (0..3).for_each(|k| sum.0[k] += counts[k]);
        sum.1 = sum.1.max(t.slowest);
        line(&t.target, counts, t.slowest)?;
    }
    line("all", sum.0, sum.1)?;
    for t in tallies {
        for f in &t.findings {
            say(&format!(
                "FOUND {} seed {} case {}: {} ({})",
                t.target,
                common.seed,
                f.case,
                f.what,
                f.file.display()
            ))?;
        }
    }
    Ok(())
}

fn kill(enough: Enough, common: &Common) -> anyhow::Result<()> {
    let program = refraxel_campaign::training::program(common.program.as_deref())?;
    let counts = kills::run(&program, common.seed, enough, &common.out.join("kills"))?;
    say(&counts.text())?;
    ensure!(counts.is_good(), "something was lost");
    Ok(())
}

fn replay(target: &Target, files: &[PathBuf]) -> anyhow::Result<()> {
    keep_panics();
    let folder = tempfile::tempdir()?;
    let bench = Bench::new(target, folder.path())?;
    for file in files {
        let content = fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
        let answer = ask(target, &bench, &content);
        writeln!(io::stderr(), "{} {}: {answer:?}", target.name, file.display())?;
        ensure!(!matches!(answer, Answer::Broken(_)), "{} breaks {}", file.display(), target.name);
    }
    Ok(())
}

/// Every stored file, in the order of its name.
fn replay_all(folder: &Path) -> anyhow::Result<()> {
    let entries = |path: &Path| -> anyhow::Result<Vec<PathBuf>> {
        let read = fs::read_dir(path).with_context(|| format!("cannot read {}", path.display()))?;
        let mut all = read.map(|e| Ok(e?.path())).collect::<io::Result<Vec<_>>>()?;
        all.sort();
        Ok(all)
    };
    let mut count = 0;
    for target in entries(folder)?.iter().filter(|path| path.is_dir()) {
        let name = target.file_name().and_then(|n| n.to_str()).context("a name that is no text")?;
        let files = entries(target)?;
        count += files.len();
        replay(&targets::named(name)?, &files)?;
    }
    say(&format!("stored inputs: {count}, all used or refused"))
}
