//! The training itself: until its end, Ctrl-C or the clock, with a save now and then.

use super::evidence;
use super::failure::session_failure;
use super::folder::RunFolder;
use super::log::Log;
use super::saving::Saving;
use super::viewing::Viewing;
use super::watch::ProgressDisplay;
use crate::exit::{Exit, Failure};
use crate::verbs::interrupts::keeps;
use refraxel_data::atomic::WriteError;
use refraxel_train::TrainError;
use refraxel_train::events::{Event, Shown};
use refraxel_train::session::{Session, SessionError, Stop, Until};
use std::num::NonZeroU64;
use std::path::Path;

/// Train to the end and save. A run that is overwritten stays until the new one is saved for the first time.
pub(super) fn learn(
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
            Err(error) if goes_on => {
                watch.warn(&format!("{error}; training continues and saves again later"))
            }
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
        viewing.end(&session, stop);
    }
    if stop == Stop::Finished {
        return Ok(());
    }
    let step = session.state().step;
    Err(Exit::Interrupted
        .because(format!("stopped at step {step} and saved; the same command with --resume continues")))
}

/// The device failed: what is left of the run is saved.
fn device_failed(session: &mut Session, out: &Path, fault: &str) -> Failure {
    let saved = session.save(out);
    let kept = match session.saved_step() {
        0 => "nothing was learned before".to_owned(),
        step => format!(
            "{} is saved as it was at step {step}: the same command with --resume continues from there, also with --device cpu",
            out.display()
        ),
    };
    let failure = Exit::Device.because(format!("{fault}\n  {kept}"));
    match saved {
        Ok(()) => failure,
        Err(unsaved) => failure.within(unsaved.to_string()),
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
    format!("{} is as saved at step {step}, and --resume continues from there", out.display())
}

/// What a run can do without must not end it.
fn warn(watch: &mut ProgressDisplay, written: Result<(), WriteError>) {
    if let Err(error) = written {
        watch.warn(&error.to_string());
    }
}
