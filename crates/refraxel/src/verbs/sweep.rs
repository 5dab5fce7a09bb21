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
use refraxel_data::{Dataset, OpenOptions};
use refraxel_train::checkpoint::write_atomic;
use results::{Row, State};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;

/// The verb.
pub fn run(args: &SweepArgs) -> Result<(), Failure> {
    let (jobs, console) = (plan::jobs(&args.plan, &args.out)?, Console::new(args.work.json));
    if let Some(file) = &args.slurm {
        write_atomic(file, |f| f.write_all(slurm(args, jobs.len()).as_bytes()))?;
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
        let row = Row::of(job, Some(&evaluation), State::Done);
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
fn check_data(jobs: &[Job]) -> Result<(), Failure> {
    let all: BTreeMap<&PathBuf, &str> = jobs.iter().map(|job| (&job.data, job.dataset.as_str())).collect();
    for (path, name) in all {
        let data = Dataset::open(path, &OpenOptions::default()).map_err(super::data_failure);
        let data =
            data.map_err(|f| Failure::new(f.exit, f.error.context(format!("dataset {name} of the plan"))))?;
        if data.split.test.is_empty() {
            let error = anyhow!(
                "dataset {name} of the plan, {}, holds no images out: its runs could not be scored",
                path.display()
            );
            return Err(Failure::new(Exit::BadInput, error));
        }
    }
    Ok(())
}

/// Trains what is not done, each run in a process of its own; the numbers of those that failed.
fn train_all(jobs: &[Job], args: &SweepArgs) -> Result<Vec<usize>, Failure> {
    let program = std::env::current_exe().context("cannot find this program again").or_exit(Exit::Io)?;
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
            let is_done = train_one(&program, job, args, threads)?;
            let (_, done, progress, failed) = &mut *lock(&state);
            *done += usize::from(is_done);
            progress.set(*done as u64, &job.name);
            if !is_done && !interrupted() {
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

/// Trains one run; false if that failed. Ctrl-C reaches its process too, which saves and ends.
fn train_one(program: &Path, job: &Job, args: &SweepArgs, threads: usize) -> Result<bool, Failure> {
    create_folder(&job.folder)?;
    let path = log(job);
    let file = std::fs::File::create(&path)
        .with_context(|| format!("cannot write {}", path.display()))
        .or_exit(Exit::Io)?;
    let status = Command::new(program)
        .arg("sweep")
        .arg(&args.plan)
        .arg("--out")
        .arg(&args.out)
        .args(["--only", &job.number.to_string(), "--threads", &threads.to_string(), "--json"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(file)
        .status();
    let status = status.with_context(|| format!("cannot start {}", program.display())).or_exit(Exit::Io)?;
    Ok(status.success())
}

/// A script whose task k trains run k; the same command without `--only` then writes the table.
fn slurm(args: &SweepArgs, count: usize) -> String {
    let (plan, out) = (super::absolute(&args.plan), super::absolute(&args.out));
    let (plan, out) = (quoted_path(&plan), quoted_path(&out));
    format!(
        "#!/bin/sh\n#SBATCH --job-name=refraxel-sweep\n#SBATCH --array=0-{last}\n#SBATCH --requeue\n\
         # A task that was lost is started again and goes on from its last checkpoint. When all are done,\n\
         #   refraxel sweep {plan} --out {out}\n# writes the table and the page.\n\
         exec refraxel sweep {plan} --out {out} --only \"$SLURM_ARRAY_TASK_ID\" \\\n    \
         --threads \"${{SLURM_CPUS_PER_TASK:-1}}\"\n",
        last = count.saturating_sub(1),
    )
}
