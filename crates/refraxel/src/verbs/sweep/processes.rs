//! Runs that are trained each in a process of its own.

use super::job::Job;
use super::results::collect;
use crate::cli::SweepArgs;
use crate::exit::{Exit, Failure, OrExit};
use crate::locked::locked;
use crate::progress::{Progress, Show};
use crate::verbs::files::create_folder;
use crate::verbs::interrupts::interrupted;
use anyhow::Context;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::Duration;

/// How long a signal waits at most until the process of a run hears it.
const PATIENCE: Duration = Duration::from_millis(50);

pub(super) fn this_program() -> Result<PathBuf, Failure> {
    std::env::current_exe().context("cannot find this program again").or_exit(Exit::Io)
}

/// Trains what is not done, each run in a process of its own; the numbers of those that failed.
pub(super) fn train_all(jobs: &[Job], args: &SweepArgs) -> Result<Vec<usize>, Failure> {
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
            let Some(job) = locked(&state).0.next().filter(|_| !interrupted()) else { return Ok(()) };
            let has_ended_well = train_one(&program, job, args, threads)?;
            // Another process may train it: then it is open, and has not failed.
            let is_done = has_ended_well && job.done()?.is_some();
            let (_, done, progress, failed) = &mut *locked(&state);
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

/// What the process of a run says.
pub(super) fn log(job: &Job) -> PathBuf {
    job.folder.join("sweep.log")
}

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
