//! `refraxel train`: from a dataset to an evaluated run.

pub mod evidence;
mod folder;
mod lock;
mod log;
mod saving;
mod viewing;
mod watch;

use super::eval::evaluate;
use super::interrupts::{cancel, keeps, watch_for_interrupts};
use super::{
    absolute, create_folder, data_failure, known_index, open_options, options, reduce, set_threads, source_of,
};
use crate::cli::{ReadingArgs, Refraction, SplitName, TrainArgs};
use crate::console::Console;
use crate::device::{self, Decided, Joined, Needs, ProcessGroup};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::table::bytes;
use anyhow::anyhow;
pub use folder::RunFolder;
pub use lock::Lock;
use log::Log;
use refraxel_data::{Dataset, scene_region};
use refraxel_train::checkpoint::WriteError;
use refraxel_train::communicator::Traffic;
use refraxel_train::device::DeviceChoice;
use refraxel_train::events::{Event, Shown};
use refraxel_train::options::Switch;
use refraxel_train::run::Run;
use refraxel_train::session::{Session, SessionError, Setup, Stop, Until};
use refraxel_train::{Options, TrainError, refraction_search};
use saving::Saving;
use std::num::NonZeroU64;
use std::path::Path;
use viewing::Viewing;
pub(super) use watch::ProgressDisplay;

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
            let evaluation = evaluate(args.out(), SplitName::Test, device, show)?;
            let out = super::evaluation::folder(args.out(), SplitName::Test);
            super::eval::print(&evaluation, &out, SplitName::Test, console)?;
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

/// Whether some photographs are held out, by which a run is scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeldOut {
    /// None is.
    No,
    /// Some are.
    Yes,
}

const NOT_SCORED: &str = "no images are held out: the run is not scored";

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
pub(super) fn train_locked(
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
    let before = saved.as_ref().map(|run| &run.source);
    let crop = as_before(
        "--crop",
        args.reading.crop.filter(|c| !c.is_none()),
        before.map(|s| s.crop),
        |c| c.to_string(),
        args,
    )?;
    let components = |up: [f64; 3]| up.map(|c| c.to_string()).join(",");
    let up = as_before("--up", args.reading.up, before.map(|s| s.up), components, args)?;
    let reduced = args.downscale.map(u32::from);
    let downscale = as_before("--downscale", reduced, before.map(|s| s.downscale), |n| n.to_string(), args)?;
    let reading = open_options(&ReadingArgs { crop, up, ..args.reading.clone() });
    let mut data = Dataset::open(args.data(), &reading).map_err(data_failure)?;
    reduce(&mut data, downscale, args.data(), show)?;
    let held_out = if data.split.test.is_empty() { HeldOut::No } else { HeldOut::Yes };
    if held_out == HeldOut::No {
        let rule = &data.split.rule;
        show.say(&format!("note: {NOT_SCORED} ({rule}); name some for testing to learn how good it is"));
    }
    let mut source = source_of(args.data(), &reading, &data);
    source.downscale = downscale;
    let earlier = saved.as_ref().and_then(|run| run.source.index_from.clone());
    source.index_from = args.index_from.as_deref().map(absolute).or(earlier);
    let options = match &saved {
        Some(run) => options::resumed(args, run.options.clone())?,
        None => options_of_new_run(args, &data)?,
    };
    let index = known_index::read(&source, &data, saved.as_ref(), &options)?;
    let setup = Setup { data, options, index, source, cancel: cancel() };
    let needs = Needs { options: &setup.options, saved: saved.as_ref() };
    let Decided { opened, device } = device::decide(args.device, group, needs, show)?;
    let mut watch = ProgressDisplay::new(show);
    let mut load = |event| watch.load(&event);
    let session = match saved {
        Some(run) => {
            Session::resume(setup, run, |model, state| opened.backend(model, Some(state)), &mut load)
        }
        None => Session::start(setup, |model| opened.backend(model, None), &mut load),
    };
    let mut session = session.map_err(session_failure)?;
    session.name_device(device);
    create_folder(args.out())?;
    let lock = lock.map_or_else(|| Lock::take(folder.path(), show), Ok)?;
    let name = super::view::name(args.out());
    let viewing = server.map(|server| Viewing::start(server, name, &session, show));
    learn(session, &folder, args.overwrite, watch, viewing)?;
    Ok((lock, held_out))
}

/// The options of a run that begins. Rays bend as asked for, else where something says, or the detector finds, what is refractive.
fn options_of_new_run(args: &TrainArgs, data: &Dataset) -> Result<Options, Failure> {
    let mut usual = Options::suited_to(scene_region(data).unbounded);
    let is_told =
        args.refraction_box.is_some() || args.index_from.is_some() || refraction_search::has_masks(data);
    usual.refraction.bend = match args.refraction {
        Refraction::On => Switch::On,
        Refraction::Auto if is_told => Switch::On,
        Refraction::Auto | Refraction::Off => Switch::Off,
    };
    if args.refraction == Refraction::On {
        usual.judge.straight = Switch::Off;
        // Who knows that something refracts says where.
        usual.detection.enabled = Switch::Off;
    }
    let mut options = options::read(args, usual)?;
    if args.refraction == Refraction::Auto && !is_told && options.detection.enabled.is_on() {
        options.refraction.bend = Switch::On;
    }
    Ok(options)
}

/// How photographs are read: as the run that goes on says.
fn as_before<T: Copy + PartialEq>(
    flag: &str,
    asked: Option<T>,
    stored: Option<Option<T>>,
    text: impl Fn(T) -> String,
    args: &TrainArgs,
) -> Result<Option<T>, Failure> {
    let Some(stored) = stored else { return Ok(asked) };
    if asked.is_none() || asked == stored {
        return Ok(stored);
    }
    let was = stored.map_or_else(|| format!("without {flag}"), |v| format!("with {flag} {}", text(v)));
    let error = anyhow!(
        "{} was trained {was}; --resume goes on so: leave {flag} out, or start a new run",
        args.out().display()
    );
    Err(Failure::new(Exit::BadInput, error))
}

/// Train to the end and save. A run that is overwritten stays until the new one is saved for the first time.
fn learn(
    mut session: Session,
    folder: &RunFolder,
    overwrite: bool,
    mut watch: ProgressDisplay,
    mut viewing: Option<Viewing>,
) -> Result<(), Failure> {
    let out = folder.path();
    folder.remove_leftovers();
    keeps(kept_before(folder, session.state().step));
    // Of a time budget nobody knows the steps: thousandths of the time are shown instead.
    let length = session.options().run.clone();
    if length.minutes > 0.0 {
        watch.start_clock(length.minutes);
    } else {
        watch.start(Some(length.steps));
    }
    let mut log = Log::open(out, session.state().step);
    warn(&mut watch, log.complete());
    let stop_after = NonZeroU64::new(length.stop_after).map(u64::from);
    let mut saving = Saving::new(length.save_every);
    let mut replaces = overwrite;
    let mut convincing: Vec<Shown> = Vec::new();
    let stop = loop {
        watch.stands(session.progress());
        let stop = session.run(Until::elapsed(saving.pause()), &mut |event| {
            watch.tell(&event);
            log.note(&event);
            if let Event::Judged { pictures, .. } = &event {
                convincing.clone_from(pictures);
            }
            if let Some(viewing) = &mut viewing {
                viewing.tell(&event);
            }
        });
        let stop = match stop {
            Err(SessionError::Train(TrainError::Device { fault })) => {
                let failure = device_failed(&mut session, out, &fault);
                if replaces && session.saved_step() > 0 {
                    folder.clear_scores()?;
                }
                warn(&mut watch, log.complete());
                return Err(failure);
            }
            stop => stop.map_err(session_failure)?,
        };
        if std::mem::take(&mut replaces) {
            folder.clear_scores()?;
        }
        let goes_on = stop == Stop::Reached && stop_after.is_none_or(|last| session.state().step < last);
        match saving.time(|| session.save(out)) {
            Ok(()) => keeps(as_saved(out, session.state().step)),
            // What was learned is still in memory, and there may be room for it next time.
            Err(error) if goes_on => watch.warn(&format!("{error}; training goes on and saves again later")),
            Err(error) => return Err(error.into()),
        }
        warn(&mut watch, log.complete());
        warn(&mut watch, evidence::draw(&std::mem::take(&mut convincing), out));
        let has_waited = stop == Stop::Cancelled && viewing.as_mut().is_some_and(Viewing::wait);
        let is_to_end = viewing.as_ref().is_some_and(Viewing::is_to_end);
        if is_to_end || !(goes_on || has_waited) {
            break stop;
        }
    };
    warn(&mut watch, log.draw(out));
    watch.end(stop == Stop::Finished);
    if let Some(viewing) = viewing {
        viewing.end(&session);
    }
    if stop == Stop::Finished {
        return Ok(());
    }
    let step = session.state().step;
    let note = anyhow!("stopped at step {step} and saved; the same command with --resume goes on");
    Err(Failure::new(Exit::Interrupted, note))
}

/// The device failed: what is left of the run is saved.
fn device_failed(session: &mut Session, out: &Path, fault: &str) -> Failure {
    let saved = session.save(out);
    let kept = match session.saved_step() {
        0 => "nothing was learned before".to_owned(),
        step => format!(
            "{} is saved as it was at step {step}: the same command with --resume goes on from there, also with --device cpu",
            out.display()
        ),
    };
    let error = anyhow!("{fault}\n  {kept}");
    match saved {
        Ok(()) => Failure::new(Exit::Device, error),
        Err(unsaved) => Failure::new(Exit::Device, error.context(unsaved.to_string())),
    }
}

/// What a program that ends before its first save has kept.
fn kept_before(folder: &RunFolder, step: u64) -> String {
    match step {
        0 if folder.holds_run() => format!("the earlier run in {} is unchanged", folder.path().display()),
        0 => "nothing of this run is kept".to_owned(),
        step => as_saved(folder.path(), step),
    }
}

/// What a program that ends after a save has kept.
fn as_saved(out: &Path, step: u64) -> String {
    format!("{} is as saved at step {step}, and --resume goes on from there", out.display())
}

/// What a run can do without must not end it.
fn warn(watch: &mut ProgressDisplay, written: Result<(), WriteError>) {
    if let Err(error) = written {
        watch.warn(&error.to_string());
    }
}

/// The failure of a session: diverged, interrupted, or refused.
pub fn session_failure(error: SessionError) -> Failure {
    match error {
        SessionError::Data(e) => data_failure(e),
        SessionError::Train(TrainError::Diverged { .. }) => Failure::new(Exit::Numerical, error),
        SessionError::Evaluate(e) => e.into(),
        SessionError::Train(TrainError::Device { .. }) | SessionError::Backend(_) => {
            Failure::new(Exit::Device, error)
        }
        SessionError::Cancelled(_) => {
            let note = anyhow!("stopped before training began; nothing was saved or changed");
            Failure::new(Exit::Interrupted, note)
        }
        _ => Failure::new(Exit::BadInput, error),
    }
}
