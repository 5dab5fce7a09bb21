//! The walk of a sweep: the plan, then a script, a list, one run or all of them, and their scores.

use super::plan::{self, check_data, chosen};
use super::processes::{log, this_program, train_all};
use super::results::{self, Row, State, collect, rows};
use super::slurm::slurm;
use crate::cli::SweepArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::shell::quoted_path;
use crate::verbs::files::{create_folder, write_text};
use crate::verbs::interrupts::{interrupted, watch_for_interrupts};
use crate::verbs::threads::set_threads;

/// The verb.
pub fn run(args: &SweepArgs) -> Result<(), Failure> {
    let (jobs, console) = (plan::jobs(&args.plan, &args.out)?, Console::new(args.work.json));
    if let Some(file) = &args.slurm {
        check_data(&jobs)?;
        let program = this_program()?;
        write_text(file, &slurm(&program, args, jobs.len()))?;
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
        return Err(
            Exit::Interrupted.because(format!("stopped with {open} runs left; the same command continues"))
        );
    }
    match failed.first() {
        None => Ok(()),
        Some(&first) => Err(Exit::BadInput.because(format!(
            "{} of {} runs failed, {} first; {} says why",
            failed.len(),
            jobs.len(),
            jobs[first].name,
            log(&jobs[first]).display()
        ))),
    }
}
