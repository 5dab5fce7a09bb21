//! A long run: memory over time, interruptions at random moments, and the bits at the end.

use crate::training::{Running, Training, differences, glass_ball, leftovers, program, step};
use anyhow::{Context, ensure};
use clap::Args;
use refraxel::plot::{Plot, Series};
use refraxel_train::run::CHECKPOINT;
use serde::Serialize;
use std::fs;
use std::io::{self, Write};
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
    /// Steps of each run, instead of the number that a short run says fit into the time
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
    steps: u64,
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
/// Steps that tell the speed.
const TRIAL: u64 = 400;

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
    let steps = args.steps.map_or_else(|| fitting(&training(TRIAL), args), Ok)?;
    let training = training(steps);
    let mut figures = Figures { steps, threads: args.threads, seed: args.seed, ..Figures::default() };
    let [undisturbed, disturbed] = ["undisturbed", "disturbed"].map(|name| fresh(&args.out.join(name)));
    say(&format!("{steps} steps undisturbed"))?;
    let start = Instant::now();
    let mut running = training.start(&undisturbed)?;
    let (memory, _) = watch(&mut running, start, None)?;
    ensure!(running.finish()?.success(), "the undisturbed run fails: {}", running.said());
    figures.undisturbed_minutes = minutes(start);
    say(&format!("{:.1} min; now with {} interruptions", figures.undisturbed_minutes, args.interruptions))?;
    let disturbed_memory = disturb(&training, &disturbed, args, &mut figures)?;
    figures.memory = [quarter(&memory, 2), quarter(&memory, 3)];
    figures.peak_mib = memory.iter().chain(&disturbed_memory).map(|m| m.1).fold(0.0, f64::max);
    figures.differences = differences(&undisturbed, &disturbed)?;
    report(args, &figures, [memory, disturbed_memory])
}

fn settings(steps: u64) -> Vec<String> {
    // Few rays and a small grid: many steps and saves in an hour.
    let fixed = ["run.batch=1024", "run.save_every=10", "grid.resolution=64", "field.sh_degree=1"];
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

/// Steps for half of the time, as a short run tells.
fn fitting(trial: &Training, args: &SoakArgs) -> anyhow::Result<u64> {
    let start = Instant::now();
    let run = fresh(&args.out.join("trial"));
    let mut running = trial.start(&run)?;
    ensure!(running.finish()?.success(), "the trial fails: {}", running.said());
    let steps = TRIAL as f64 * 30.0 * args.minutes / start.elapsed().as_secs_f64();
    Ok((steps as u64).max(TRIAL))
}

/// Samples the memory until the program ends, or until a moment.
fn watch(running: &mut Running, start: Instant, until: Option<Instant>) -> anyhow::Result<(Memory, bool)> {
    let mut memory = Memory::new();
    loop {
        if running.wait(SAMPLE)?.is_some() {
            return Ok((memory, true));
        }
        memory.extend(resident(running.id()).map(|mib| (minutes(start), mib)));
        if until.is_some_and(|moment| Instant::now() >= moment) {
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

/// The same run, interrupted at random moments of its expected time.
fn disturb(
    training: &Training,
    run: &Path,
    args: &SoakArgs,
    figures: &mut Figures,
) -> anyhow::Result<Memory> {
    let mut random = fastrand::Rng::with_seed(args.seed);
    let length = 60.0 * figures.undisturbed_minutes;
    let mut moments: Vec<f64> = (0..args.interruptions).map(|_| random.f64() * length).collect();
    moments.sort_by(f64::total_cmp);
    let (start, mut all) = (Instant::now(), Memory::new());
    for (k, moment) in moments.iter().enumerate() {
        let mut running = training.start(run)?;
        let until = (start + Duration::from_secs_f64(*moment)).max(Instant::now() + Duration::from_secs(2));
        let (memory, ended) = watch(&mut running, start, Some(until))?;
        all.extend(memory);
        if ended {
            break;
        }
        let signal = ["KILL", "INT", "KILL", "TERM"][k % 4];
        if signal == "KILL" {
            figures.kills += 1;
            running.kill()?;
        } else {
            figures.signals += 1;
            running.send(signal)?;
            let code = running.finish()?.code();
            ensure!(matches!(code, Some(0 | 130)), "code {code:?} after {signal}: {}", running.said());
        }
        all.push((minutes(start), f64::NAN)); // the curve is interrupted, too
        let saved = run.join(CHECKPOINT).exists().then(|| step(run)).transpose()?.unwrap_or(0);
        say(&format!("{:.1} min: {signal}, saved at step {saved}", minutes(start)))?;
    }
    let mut running = training.start(run)?;
    all.extend(watch(&mut running, start, None)?.0);
    let status = running.finish()?;
    ensure!(status.success(), "the disturbed run fails: {}", running.said());
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
    let [earlier, last] = figures.memory;
    ensure!(
        last <= GROWTH * earlier,
        "memory grows: {earlier:.0} MiB in the third quarter, {last:.0} in the last"
    );
    say("the bits at the end are the same, and memory is flat")
}
