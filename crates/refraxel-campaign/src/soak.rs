//! A long run: memory over time, interruptions at random moments, and the bits at the end.

use crate::training::{Running, Training, differences, glass_ball, leftovers, program, step};
use anyhow::{Context, ensure};
use clap::Args;
use refraxel::plot::{Plot, Series};
use refraxel_train::run::CHECKPOINT;
use serde::Serialize;
use std::fs;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// `campaign soak`
#[derive(Args, Clone, Debug)]
pub struct SoakArgs {
    /// Time of both runs, the undisturbed and the disturbed one [minute]
    #[arg(long, default_value_t = 60.0)]
    minutes: f64,
    /// Interruptions of the disturbed run: half of them kill -9, the others SIGINT or SIGTERM
    #[arg(long, default_value_t = 10)]
    interruptions: u32,
    /// Seed of the moments
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Steps of the schedule; otherwise more than fit into the time. A run that is not over by its time is stopped, and the other
    /// one stops at the same step
    #[arg(long)]
    steps: Option<u64>,
    /// Threads of a training
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Folder for the figures and the plot
    #[arg(long, default_value = "campaign/soak")]
    out: PathBuf,
    /// The refraxel program [default: the one beside this program]
    #[arg(long)]
    program: Option<PathBuf>,
}

/// What a soak has shown.
#[derive(Debug, Default, Serialize)]
struct Figures {
    /// Steps of the schedule.
    steps: u64,
    /// The step at which both runs ended.
    last_step: u64,
    threads: usize,
    seed: u64,
    undisturbed_minutes: f64,
    disturbed_minutes: f64,
    /// Resident memory of the undisturbed run in the third and in the last quarter of its time, medians [MiB].
    memory: [f64; 2],
    peak_mib: f64,
    kills: u32,
    signals: u32,
    differences: Vec<String>,
}

/// Resident memory over time [min, MiB].
type Memory = Vec<(f64, f64)>;
/// Time between two samples of the memory.
const SAMPLE: Duration = Duration::from_millis(500);
/// Memory of the last quarter against the third, at most. Grids get finer before.
const GROWTH: f64 = 1.1;
/// Steps from which on a run says something about memory: before, most of its time goes into what its rays bend at, and a search needs
/// other memory than a race.
const LEAST: u64 = 10_000;
/// Steps of the two runs that tell the speed. Both have the same straight phase and the same race, so that the second costs more
/// only for its last steps.
const TRIALS: [u64; 2] = [1200, 3600];
/// Steps of the schedule by those that fit into the time on a machine without other work.
const MARGIN: f64 = 1.5;
/// Exit code of a run that was interrupted and saved, or has met `run.stop_after`.
const INTERRUPTED: i32 = 130;

/// The verb.
pub fn run(args: &SoakArgs) -> anyhow::Result<()> {
    fs::create_dir_all(&args.out).with_context(|| format!("cannot create {}", args.out.display()))?;
    let data = args.out.join("data");
    glass_ball(&data, 96, 60)?;
    let program = program(args.program.as_deref())?;
    let training = |steps: u64| Training {
        program: program.clone(),
        data: data.clone(),
        settings: settings(steps),
        threads: args.threads,
    };
    let steps = args.steps.map_or_else(|| fitting(training, args), Ok)?;
    let mut training = training(steps);
    let mut figures = Figures { steps, threads: args.threads, seed: args.seed, ..Figures::default() };
    let [undisturbed, disturbed] = ["undisturbed", "disturbed"].map(|name| fresh(&args.out.join(name)));
    say(&format!("{steps} steps undisturbed"))?;
    let memory = leave_alone(&training, &undisturbed, args, &mut figures)?;
    if figures.last_step < steps {
        training.settings.push(format!("run.stop_after={}", figures.last_step));
    }
    let [time, last, times] =
        [figures.undisturbed_minutes, figures.last_step as f64, args.interruptions.into()];
    say(&format!("{time:.1} min to step {last}; now with {times} interruptions"))?;
    let disturbed_memory = disturb(&training, &disturbed, args, &mut figures)?;
    figures.memory = [quarter(&memory, 2), quarter(&memory, 3)];
    figures.peak_mib = memory.iter().chain(&disturbed_memory).map(|m| m.1).fold(0.0, f64::max);
    figures.differences = differences(&undisturbed, &disturbed)?;
    report(args, &figures, [memory, disturbed_memory])
}

fn settings(steps: u64) -> Vec<String> {
    // Few rays and a small grid: many steps and saves in an hour. One grid: a finer one would look like a leak.
    let fixed =
        ["run.batch=1024", "run.save_every=10", "grid.resolution=64", "grid.stages=1", "field.sh_degree=1"];
    let mut all = fixed.map(str::to_owned).to_vec();
    all.push(format!("run.steps={steps}"));
    all
}

fn fresh(path: &Path) -> PathBuf {
    let _ = fs::remove_dir_all(path); // it may not be there
    path.to_owned()
}

fn minutes(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() / 60.0
}

fn say(line: &str) -> anyhow::Result<()> {
    Ok(writeln!(io::stdout(), "{line}")?)
}

/// Steps of a schedule that is not over before half of the time is, as two short runs tell. The processor's time counts, for
/// other work on the machine may come and go.
fn fitting(training: impl Fn(u64) -> Training, args: &SoakArgs) -> anyhow::Result<u64> {
    let mut seconds = [0.0; 2];
    for (steps, seconds) in TRIALS.into_iter().zip(&mut seconds) {
        let (clock, before) = (Instant::now(), children_seconds());
        let mut running = training(steps).start(&fresh(&args.out.join("trial")))?;
        ensure!(running.finish()?.success(), "the trial fails: {}", running.said());
        *seconds = match (before, children_seconds()) {
            (Some(before), Some(after)) => (after - before) / args.threads as f64,
            _ => clock.elapsed().as_secs_f64(),
        };
    }
    let a_step = (seconds[1] - seconds[0]).max(1e-3) / (TRIALS[1] - TRIALS[0]) as f64;
    Ok(((MARGIN * 30.0 * args.minutes / a_step) as u64).max(TRIALS[1]))
}

/// Seconds that processors gave to the programs that this one has started and that have ended, where the system tells.
fn children_seconds() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    let after_name = stat.rsplit_once(')')?.1;
    let times: Vec<f64> = after_name.split_whitespace().skip(13).take(2).flat_map(str::parse).collect();
    const TICKS: f64 = 100.0; // a second has as many on Linux
    (times.len() == 2).then(|| times.iter().sum::<f64>() / TICKS)
}

/// A run that nobody disturbs, stopped when its time is over.
fn leave_alone(
    training: &Training,
    run: &Path,
    args: &SoakArgs,
    figures: &mut Figures,
) -> anyhow::Result<Memory> {
    let (start, limit) = (Instant::now(), Duration::from_secs_f64(30.0 * args.minutes));
    let mut running = training.start(run)?;
    let (memory, ended) = watch(&mut running, start, |_| start.elapsed() >= limit)?;
    if !ended {
        running.send("INT")?;
    }
    let code = running.finish()?.code();
    ensure!(matches!(code, Some(0 | INTERRUPTED)), "the undisturbed run fails: {}", running.said());
    figures.last_step = step(run)?;
    figures.undisturbed_minutes = minutes(start);
    Ok(memory)
}

/// Samples the memory until the program ends, or until it is time.
fn watch(
    running: &mut Running,
    start: Instant,
    mut is_time: impl FnMut(&Running) -> bool,
) -> anyhow::Result<(Memory, bool)> {
    let mut memory = Memory::new();
    loop {
        if running.wait(SAMPLE)?.is_some() {
            return Ok((memory, true));
        }
        memory.extend(resident(running.id()).map(|mib| (minutes(start), mib)));
        if is_time(running) {
            return Ok((memory, false));
        }
    }
}

/// Resident memory of a process [MiB], where the system tells.
fn resident(id: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    line.trim().trim_end_matches("kB").trim().parse::<f64>().ok().map(|kib| kib / 1024.0)
}

/// The last step of which the log of a run tells.
fn logged(run: &Path) -> u64 {
    const LINES: i64 = 4096; // bytes that hold some of the last lines
    let mut end = Vec::new();
    let read = fs::File::open(run.join("log.jsonl")).and_then(|mut log| {
        let _ = log.seek(SeekFrom::End(-LINES)); // a short log is read from its start
        log.read_to_end(&mut end)
    });
    let lines = read.map(|_| String::from_utf8_lossy(&end)).unwrap_or_default();
    let last = lines.lines().rev().find_map(|l| serde_json::from_str::<serde_json::Value>(l).ok());
    last.and_then(|entry| entry["step"].as_u64()).unwrap_or(0)
}

/// The same run, interrupted at random steps.
fn disturb(
    training: &Training,
    run: &Path,
    args: &SoakArgs,
    figures: &mut Figures,
) -> anyhow::Result<Memory> {
    let mut random = fastrand::Rng::with_seed(args.seed);
    let mut places: Vec<u64> = (0..args.interruptions).map(|_| random.u64(..figures.last_step)).collect();
    places.sort_unstable();
    let (start, mut all) = (Instant::now(), Memory::new());
    for (k, place) in places.into_iter().enumerate() {
        let mut running = training.start(run)?;
        let (memory, ended) = watch(&mut running, start, |_| logged(run) >= place)?;
        all.extend(memory);
        ensure!(!ended, "the disturbed run ends early: {}", running.said());
        // The log has a line every 25 steps: within these, any moment.
        std::thread::sleep(SAMPLE.mul_f64(random.f64()));
        let signal = ["KILL", "INT", "KILL", "TERM"][k % 4];
        if signal == "KILL" {
            figures.kills += 1;
            running.kill()?;
        } else {
            figures.signals += 1;
            running.send(signal)?;
            let code = running.finish()?.code();
            ensure!(
                matches!(code, Some(0 | INTERRUPTED)),
                "code {code:?} after {signal}: {}",
                running.said()
            );
        }
        all.push((minutes(start), f64::NAN)); // the curve is interrupted, too
        let saved = run.join(CHECKPOINT).exists().then(|| step(run)).transpose()?.unwrap_or(0);
        say(&format!("{:.1} min: {signal} after step {place}, saved at step {saved}", minutes(start)))?;
    }
    let mut running = training.start(run)?;
    all.extend(watch(&mut running, start, |_| false)?.0);
    let code = running.finish()?.code();
    ensure!(matches!(code, Some(0 | INTERRUPTED)), "the disturbed run fails: {}", running.said());
    ensure!(leftovers(run) == 0, "temporary files are left");
    figures.disturbed_minutes = minutes(start);
    Ok(all)
}

/// Median of a quarter of the time.
fn quarter(memory: &Memory, which: usize) -> f64 {
    let n = memory.len();
    let mut part: Vec<f64> = memory[n * which / 4..n * (which + 1) / 4].iter().map(|m| m.1).collect();
    part.sort_by(f64::total_cmp);
    part.get(part.len() / 2).copied().unwrap_or(f64::NAN)
}

fn report(args: &SoakArgs, figures: &Figures, memory: [Memory; 2]) -> anyhow::Result<()> {
    let [undisturbed, disturbed] = memory;
    let series = |name: &str, points| Series { name: name.to_owned(), points };
    let plot = Plot {
        title: "Memory of a training".to_owned(),
        x_label: "minutes".to_owned(),
        y_label: "resident memory [MiB]".to_owned(),
        series: vec![
            series("undisturbed", undisturbed),
            series("killed, interrupted and resumed", disturbed),
        ],
    };
    fs::write(args.out.join("memory.svg"), plot.svg(960, 420))?;
    fs::write(args.out.join("soak.json"), serde_json::to_string_pretty(figures)?)?;
    say(&serde_json::to_string_pretty(figures)?)?;
    ensure!(figures.differences.is_empty(), "the bits differ: {}", figures.differences.join(", "));
    let steps = figures.last_step;
    ensure!(
        steps >= LEAST,
        "the bits are the same, but {steps} steps say nothing about memory: {LEAST} are needed"
    );
    let [earlier, last] = figures.memory;
    ensure!(
        last <= GROWTH * earlier,
        "memory grows: {earlier:.0} MiB in the third quarter, {last:.0} in the last"
    );
    say("the bits at the end are the same, and memory is flat")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    #[cfg(target_os = "linux")]
    fn the_processor_time_of_programs_that_ended_is_counted_and_waiting_is_not() {
        let after = |script: &str| {
            let before = children_seconds().unwrap();
            assert!(Command::new("sh").args(["-c", script]).status().unwrap().success());
            children_seconds().unwrap() - before
        };
        let waiting = after("sleep 0.5");
        let working = after("i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done");
        assert!(waiting < 0.2 && working > 0.05, "{waiting} s {working} s");
    }

    #[test]
    fn the_last_whole_line_of_a_log_says_the_step() {
        let run = tempfile::tempdir().unwrap();
        assert_eq!(logged(run.path()), 0);
        let mut log = String::new();
        for step in (25..=5000).step_by(25) {
            log += &format!("{{\"step\":{step},\"train_psnr\":21.5}}\n");
            fs::write(run.path().join("log.jsonl"), log.clone() + "{\"step\":99").unwrap();
            assert_eq!(logged(run.path()), step);
        }
    }
}
