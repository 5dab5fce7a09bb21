//! `refraxel sweep`: many runs from one plan, their table and their page.
//!
//! A run is done when it has been scored. Whoever trains it leaves a checkpoint now and then, so that the next attempt goes on
//! from there: after Ctrl-C, after a machine was lost, in another task of an array.

pub mod job;
pub mod plan;
pub mod results;

use super::interrupts::{interrupted, watch_for_interrupts};
use super::{create_folder, set_threads};
use crate::cli::SweepArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use crate::shell::quoted_path;
use anyhow::{Context, anyhow};
use job::Job;
use refraxel_train::checkpoint::write_atomic;
use results::{Row, State};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::Duration;

/// The verb.
pub fn run(args: &SweepArgs) -> Result<(), Failure> {
    let (jobs, console) = (plan::jobs(&args.plan, &args.out)?, Console::new(args.work.json));
    if let Some(file) = &args.slurm {
        check_data(&jobs)?;
        let program = this_program()?;
        write_atomic(file, |f| f.write_all(slurm(&program, args, jobs.len()).as_bytes()))?;
        let text = format!(
            "{}: an array of {} tasks; start it by `sbatch {}`",
            file.display(),
            jobs.len(),
            quoted_path(file)
        );
        return console
            .result(&text, &serde_json::json!({ "file": file, "tasks": jobs.len() }))
            .or_exit(Exit::Io);
    }
    if args.list {
        let rows = rows(&jobs, &[])?;
        return console.result(&results::text(&rows), &rows).or_exit(Exit::Io);
    }
    if let Some(number) = args.only {
        let job = chosen(&jobs, number)?;
        set_threads(&args.work)?;
        watch_for_interrupts()?;
        let evaluation = job.run(Show::suited(args.work.quiet || args.work.json))?;
        let row = Row::of(job, evaluation.as_ref(), State::Open);
        return console.result(&results::text(std::slice::from_ref(&row)), &row).or_exit(Exit::Io);
    }
    check_data(&jobs)?;
    create_folder(&args.out)?;
    watch_for_interrupts()?;
    let failed = train_all(&jobs, args)?;
    let rows = collect(&jobs, &failed, &args.out)?;
    let out = args.out.display();
    let text = format!("{}\ntable: {out}/results.csv, page: {out}/index.html", results::text(&rows));
    console.result(&text, &rows).or_exit(Exit::Io)?;
    let open = rows.iter().filter(|row| row.state != State::Done).count();
    if interrupted() {
        let note = anyhow!("stopped with {open} runs left; the same command goes on");
        return Err(Failure::new(Exit::Interrupted, note));
    }
    match failed.first() {
        None => Ok(()),
        Some(&first) => Err(Failure::new(
            Exit::BadInput,
            anyhow!(
                "{} of {} runs failed, {} first; {} says why",
                failed.len(),
                jobs.len(),
                jobs[first].name,
                log(&jobs[first]).display()
            ),
        )),
    }
}

/// A run by its number.
pub fn chosen(jobs: &[Job], number: usize) -> Result<&Job, Failure> {
    let last = jobs.len().saturating_sub(1);
    let job = jobs.get(number);
    job.ok_or_else(|| {
        Failure::new(Exit::Usage, anyhow!("the plan has no run {number}; expected a number from 0 to {last}"))
    })
}

/// The state of all runs, written as table and page. `failed`: numbers of runs whose training failed.
pub fn collect(jobs: &[Job], failed: &[usize], out: &Path) -> Result<Vec<Row>, Failure> {
    let rows = rows(jobs, failed)?;
    create_folder(out)?;
    results::write(&rows, out)?;
    Ok(rows)
}

fn rows(jobs: &[Job], failed: &[usize]) -> Result<Vec<Row>, Failure> {
    let state = |job: &Job| if failed.contains(&job.number) { State::Failed } else { State::Open };
    jobs.iter().map(|job| Ok(Row::of(job, job.done()?.as_ref(), state(job)))).collect()
}

/// Every dataset can be opened and holds images out, by which runs are scored.
pub fn check_data(jobs: &[Job]) -> Result<(), Failure> {
    let all: BTreeMap<&PathBuf, &Job> = jobs.iter().map(|job| (&job.data, job)).collect();
    all.into_values().try_for_each(Job::check_data)
}

fn this_program() -> Result<PathBuf, Failure> {
    std::env::current_exe().context("cannot find this program again").or_exit(Exit::Io)
}

/// Trains what is not done, each run in a process of its own; the numbers of those that failed.
fn train_all(jobs: &[Job], args: &SweepArgs) -> Result<Vec<usize>, Failure> {
    let program = this_program()?;
    let mut open = Vec::new();
    for job in jobs {
        if job.done()?.is_none() {
            open.push(job);
        }
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = args.work.threads.map_or(cores, usize::from).div_ceil(usize::from(args.jobs.get())).max(1);
    let done = jobs.len() - open.len();
    let show = Show::suited(args.work.quiet || args.work.json);
    let mut progress = Progress::new(show, "runs", jobs.len() as u64);
    progress.set(done as u64, "");
    let state = Mutex::new((open.into_iter(), done, progress, Vec::new()));
    let work = || -> Result<(), Failure> {
        loop {
            let Some(job) = lock(&state).0.next().filter(|_| !interrupted()) else { return Ok(()) };
            let has_ended_well = train_one(&program, job, args, threads)?;
            // Another process may train it: then it is open, and has not failed.
            let is_done = has_ended_well && job.done()?.is_some();
            let (_, done, progress, failed) = &mut *lock(&state);
            *done += usize::from(is_done);
            progress.set(*done as u64, &job.name);
            if !has_ended_well && !interrupted() {
                failed.push(job.number);
                progress.say(&format!("run {} failed; see {}", job.name, log(job).display()));
            }
            drop(collect(jobs, failed, &args.out)?);
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..args.jobs.get()).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|w| w.join().unwrap_or(Ok(())))
    })?;
    let (_, _, progress, failed) = state.into_inner().unwrap_or_else(|e| e.into_inner());
    if failed.is_empty() && !interrupted() {
        progress.finish("")
    } else {
        progress.abandon("")
    }
    Ok(failed)
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

/// What the process of a run says.
fn log(job: &Job) -> PathBuf {
    job.folder.join("sweep.log")
}

/// How long a signal waits at most until the process of a run hears it.
const PATIENCE: Duration = Duration::from_millis(50);

/// Trains one run; false if that failed. The first signal is passed on to its process, which saves and ends.
fn train_one(program: &Path, job: &Job, args: &SweepArgs, threads: usize) -> Result<bool, Failure> {
    create_folder(&job.folder)?;
    let path = log(job);
    // What an earlier attempt said stays; another process may be writing there.
    let file = std::fs::OpenOptions::new()
        .append(true)
        .create(true)
        .open(&path)
        .with_context(|| format!("cannot write {}", path.display()))
        .or_exit(Exit::Io)?;
    let mut command = Command::new(program);
    command
        .arg("sweep")
        .arg(&args.plan)
        .arg("--out")
        .arg(&args.out)
        .args(["--only", &job.number.to_string(), "--threads", &threads.to_string(), "--json"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(file);
    // Signals of the terminal reach this process alone: two of them would end the run without saving.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    let failed = || format!("cannot start {}", program.display());
    let mut child = command.spawn().with_context(failed).or_exit(Exit::Io)?;
    let mut is_told = false;
    loop {
        if let Some(status) = child.try_wait().with_context(failed).or_exit(Exit::Io)? {
            return Ok(status.success());
        }
        if interrupted() && !is_told {
            terminate(&child);
            is_told = true;
        }
        std::thread::sleep(PATIENCE);
    }
}

/// Asks a process to save and end.
#[cfg(unix)]
fn terminate(child: &Child) {
    let Ok(id) = i32::try_from(child.id()) else { return };
    // One that has ended meanwhile needs no signal.
    let _ = nix::sys::signal::kill(nix::unistd::Pid::from_raw(id), nix::sys::signal::Signal::SIGTERM);
}

/// Where there are no such signals, the console tells all its processes.
#[cfg(not(unix))]
fn terminate(_child: &Child) {}

/// A script whose task k trains run k; the same command without `--only` then writes the table.
fn slurm(program: &Path, args: &SweepArgs, count: usize) -> String {
    let program = quoted_path(program);
    let (plan, out) = (super::absolute(&args.plan), super::absolute(&args.out));
    let (plan, out) = (quoted_path(&plan), quoted_path(&out));
    format!(
        "#!/bin/sh\n#SBATCH --job-name=refraxel-sweep\n#SBATCH --array=0-{last}\n#SBATCH --requeue\n\
         # A task that was lost is started again and goes on from its last checkpoint. When all are done,\n\
         #   {program} sweep {plan} --out {out}\n# writes the table and the page.\n\
         exec {program} sweep {plan} --out {out} --only \"$SLURM_ARRAY_TASK_ID\" \\\n    \
         --threads \"${{SLURM_CPUS_PER_TASK:-1}}\"\n",
        last = count.saturating_sub(1),
    )
}
