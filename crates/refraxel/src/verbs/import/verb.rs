//! The walk of an import: everything is checked, then planned, then made.

use super::plan::Plan;
use super::source::Source;
use super::work::{self, WorkFolder};
use super::{script, tools};
use crate::cli::ImportArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::interrupts::watch_for_interrupts;
use crate::verbs::threads::set_threads;
use serde::Serialize;
use std::path::Path;

/// The verb.
pub fn run(args: &ImportArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    // Everything that can be wrong with the input is found before the first file is written.
    work::refuse_earlier(&args.out, args.overwrite)?;
    let root = work::path_for(&args.out)?;
    let colmap = tools::colmap()?;
    let (source, is_missing_ffmpeg) = Source::of(args)?;
    let plan = Plan::new(args, source, root, colmap.as_ref());
    let script = script::lines(&plan.source, &plan.colmap, &plan.root, &args.out);
    let console = Console::new(args.work.json);
    if args.dry_run {
        return console.result(&script.join("\n"), &DryRun { commands: &script }).or_exit(Exit::Io);
    }
    let missing = [(colmap.is_none(), "COLMAP"), (is_missing_ffmpeg, "ffmpeg")];
    let missing: Vec<&str> = missing.into_iter().filter(|(is, _)| *is).map(|(_, name)| name).collect();
    let Some(colmap) = colmap.filter(|_| missing.is_empty()) else {
        return Err(tools::missing(&missing, &script));
    };
    watch_for_interrupts()?;
    let work = WorkFolder::open(&plan.root, &plan.record(args, &colmap))?;
    let show = Show::suited(args.work.quiet || args.work.json);
    let report = plan.make(work, &args.out, show).map_err(|failure| kept(failure, &plan.root))?;
    console.result(&report.text(), &report).or_exit(Exit::Io)
}

#[derive(Serialize)]
struct DryRun<'a> {
    commands: &'a [String],
}

/// The failure, and that the work is not lost.
fn kept(failure: Failure, root: &Path) -> Failure {
    if !root.is_dir() {
        return failure;
    }
    let report = failure.report();
    let text = report.strip_prefix("error: ").unwrap_or(&report);
    let root = root.display();
    let text =
        format!("{text}\nthe finished steps are kept in {root}, and the same command continues from there");
    failure.exit.because(text)
}
