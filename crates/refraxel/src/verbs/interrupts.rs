//! Ctrl-C and termination signals: the first one asks for a stop, the second one ends the program at once.

use crate::exit::{Exit, Failure, OrExit, end_at_once};
use crate::locked::locked;
use crate::worker;
use anyhow::Context;
use refraxel_train::cancel::Cancel;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock};
use std::thread;
use std::time::Duration;

/// How often a program that waits looks whether it shall end.
pub const LOOK: Duration = Duration::from_millis(100);

/// Set by the first signal.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// The same wish, for long work that looks at it now and then.
static CANCEL: OnceLock<Cancel> = OnceLock::new();
/// What a second signal finds.
static STANDING: Mutex<Standing> = Mutex::new(Standing { kept: None, lock: None });

/// Where the work stands, for a program that ends at once.
struct Standing {
    /// What is on disk.
    kept: Option<String>,
    /// A lock file that would stay behind.
    lock: Option<PathBuf>,
}

/// The wish to stop that the first signal makes.
pub fn cancel() -> Cancel {
    CANCEL.get_or_init(Cancel::new).clone()
}

/// True once the user wants to stop.
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// Waits until the user wants to stop.
pub fn wait_for_interrupt() {
    while !interrupted() {
        thread::sleep(LOOK);
    }
}

/// Asks long work to stop on the first Ctrl-C or termination signal, or when a program is gone that has started this one to show it. The
/// second signal ends the program, and says what is kept.
pub fn watch_for_interrupts() -> Result<(), Failure> {
    worker::watch_starter(|| {
        INTERRUPTED.store(true, Ordering::SeqCst);
        cancel().cancel();
    });
    ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            leave();
        }
        cancel().cancel();
    })
    .context("cannot watch for Ctrl-C")
    .or_exit(Exit::Io)
}

/// From now on a program that ends at once has kept this.
pub fn keeps(what: String) {
    locked(&STANDING).kept = Some(what);
}

/// This lock file is to be removed by a program that ends at once.
pub(super) fn holds(lock: Option<&Path>) {
    locked(&STANDING).lock = lock.map(Path::to_owned);
}

fn leave() -> ! {
    let standing = locked(&STANDING);
    if let Some(lock) = &standing.lock {
        let _ = std::fs::remove_file(lock); // it is free without its holder, too
    }
    let kept = standing.kept.as_deref().unwrap_or("files that were finished before are kept");
    // Nowhere else to complain.
    let _ = writeln!(io::stderr(), "error: stopped at once by a second signal, without saving; {kept}");
    end_at_once(Exit::Interrupted)
}
