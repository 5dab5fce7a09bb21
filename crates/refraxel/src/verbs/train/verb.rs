//! The walk of a training: arguments and photographs are read, everything is decided, it learns, and its run is scored.

use super::arguments::{self, HeldOut, Input, NOT_SCORED};
use super::decide::decide;
use super::failure::start_failure;
use super::folder::RunFolder;
use super::learn::learn;
use super::lock::Lock;
use super::viewing::{self, Viewing};
use super::watch::ProgressDisplay;
use crate::cli::TrainArgs;
use crate::console::Console;
use crate::device::{self, Joined, ProcessGroup};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::table::bytes;
use crate::verbs::files::create_folder;
use crate::verbs::interrupts::{keeps, watch_for_interrupts};
use crate::verbs::threads::set_threads;
use crate::verbs::{eval, evaluation, options};
use refraxel_data::Part;
use refraxel_train::communicator::Traffic;
use refraxel_train::device::DeviceChoice;
use refraxel_train::run::Run;
use refraxel_train::session::Session;
use std::path::Path;

/// The verb.
pub fn run(args: &TrainArgs) -> Result<(), Failure> {
    if args.options {
        return options::print(args);
    }
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let show = Show::suited(args.work.quiet || args.work.json);
    let console = Console::new(args.work.json);
    let group = match device::join(args.device)? {
        Joined::Helped => return Ok(()),
        Joined::Alone => None,
        Joined::Leads(group) => Some(group),
    };
    let (_lock, held_out) = train_together(args, group.as_ref(), show)?;
    let device = group.as_ref().map_or(args.device, |_| DeviceChoice::Cpu);
    if let Some(group) = group {
        show.say(&sent(&group.root.traffic())); // and the others go home
    }
    let out = args.out().display();
    keeps(format!("the run is saved in {out}; `refraxel eval {out}` scores it"));
    match held_out {
        HeldOut::No => console.result(NOT_SCORED, &serde_json::Value::Null).or_exit(Exit::Io)?,
        HeldOut::Yes => {
            let evaluation = eval::evaluate(args.out(), Part::Test, device, show)?;
            let out = evaluation::folder(args.out(), Part::Test);
            eval::print(&evaluation, &out, Part::Test, console)?;
        }
    }
    console.say(&what_next(args.out())).or_exit(Exit::Io)
}

/// What processes have sent each other.
fn sent(traffic: &Traffic) -> String {
    let Traffic { rays, samples, shared, voxels, pixels, models } = *traffic;
    format!(
        "processes sent each other {}: rays {}, samples of the field {}, of index, mirrors and background {}, voxels {}, what rays \
         show {}, models {}",
        bytes(traffic.total()),
        bytes(rays),
        bytes(samples),
        bytes(shared),
        bytes(voxels),
        bytes(pixels),
        bytes(models),
    )
}

/// What people do with a run that is finished.
fn what_next(run: &Path) -> String {
    let run = run.display();
    format!(
        "next: refraxel render {run} --orbit 60 --out {run}/orbit    new views\n      \
         refraxel inspect {run}                              its options and scores\n      \
         refraxel compare {run} OTHER --truth --out DIR      side by side with another run"
    )
}

/// Trains to the end and saves; an interruption is a failure, after saving. Nobody else trains there until the lock is dropped.
pub fn train(args: &TrainArgs, show: Show) -> Result<(Lock, HeldOut), Failure> {
    train_together(args, None, show)
}

/// The same, with other processes where there are some.
fn train_together(
    args: &TrainArgs,
    group: Option<&ProcessGroup>,
    show: Show,
) -> Result<(Lock, HeldOut), Failure> {
    let is_there = args.out().is_dir();
    let lock = is_there.then(|| Lock::take(args.out(), show)).transpose()?;
    train_locked(args, group, lock, show)
}

/// The same, with the lock of the folder where that is there.
pub(in crate::verbs) fn train_locked(
    args: &TrainArgs,
    group: Option<&ProcessGroup>,
    lock: Option<Lock>,
    show: Show,
) -> Result<(Lock, HeldOut), Failure> {
    let folder = RunFolder::new(args.out());
    let server = viewing::bind(args.view, args.out())?;
    // Everything that can be wrong with the input is found before the first file is written.
    if !args.resume && !args.overwrite {
        folder.refuse_earlier_run()?;
    }
    let saved = if args.resume { Some(Run::load(args.out())?) } else { None };
    let Input { data, source, held_out } = arguments::read(args, saved.as_ref(), show)?;
    let (setup, mut decided) = decide(args, group, saved.as_ref(), (data, source), show)?;
    let mut watch = ProgressDisplay::new(show);
    let mut load = |event| watch.load(&event);
    let mut made = |model, state| decided.backend(args.device, model, state, show);
    let session = match saved {
        Some(run) => Session::resume(setup, run, |model, state| made(model, Some(state)), &mut load),
        None => Session::start(setup, |model| made(model, None), &mut load),
    };
    let mut session = session.map_err(|error| start_failure(error, args.out()))?;
    session.name_device(decided.device);
    create_folder(args.out())?;
    let lock = lock.map_or_else(|| Lock::take(folder.path(), show), Ok)?;
    let viewing = server.map(|server| Viewing::start(server, args.out(), &session, show));
    learn(session, &folder, args.overwrite, watch, viewing)?;
    Ok((lock, held_out))
}
