//! How the program ends: a stable exit code, and one clear message when it fails.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::panic;
use std::process::{self, ExitCode};
use std::sync::OnceLock;

use refraxel_data::atomic::WriteError;
use refraxel_train::checkpoint::CheckpointError;
use refraxel_train::metrics::MetricsError;

/// Exit codes; scripts rely on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Everything was done.
    Done = 0,
    /// The command line is wrong.
    Usage = 2,
    /// A dataset, run or option cannot be used as it is.
    BadInput = 3,
    /// A file could not be read or written.
    Io = 4,
    /// The computation diverged.
    Numerical = 5,
    /// The GPU cannot be used, or failed.
    Device = 6,
    /// The program has a bug.
    Bug = 101,
    /// Stopped by Ctrl-C or a termination signal: after saving, or at once by a second one, which says what is kept.
    Interrupted = 130,
}

impl Exit {
    /// A failure with this code and message.
    pub fn because(self, message: impl Into<String>) -> Failure {
        Failure::new(self, anyhow::Error::msg(message.into()))
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// From now on a panic ends the whole process, whatever thread it is in: others may wait for that thread for ever.
pub fn end_on_panic() {
    panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|l| format!(" at {l}")).unwrap_or_default();
        let what = panic.payload_as_str().unwrap_or("it does not say what");
        let _ = writeln!(
            io::stderr(),
            "error: the program has a bug{place}: {what}\n  please report this with the command and its input; what was \
             saved before is whole"
        ); // nowhere else to complain
        end_at_once(Exit::Bug);
    }));
}

/// What ends the program at once, where others have to be told.
static END: OnceLock<fn(i32) -> !> = OnceLock::new();

/// From now on a sudden end goes this way, with its exit code; the first call counts.
#[cfg(feature = "mpi")]
pub fn end_by(end: fn(i32) -> !) {
    let _ = END.set(end); // there is one way already
}

/// Ends the program without going back.
pub fn end_at_once(exit: Exit) -> ! {
    if let Some(end) = END.get() {
        end(exit as i32);
    }
    process::exit(exit as i32)
}

/// Why a verb stopped, and the exit code for that.
#[derive(Debug)]
pub struct Failure {
    /// The code.
    pub exit: Exit,
    /// The message and its causes.
    pub error: anyhow::Error,
}

impl Failure {
    /// A failure of a kind.
    pub fn new(exit: Exit, error: impl Into<anyhow::Error>) -> Self {
        Self { exit, error: error.into() }
    }

    /// The same, said to have happened in `what`, such as one run of many.
    #[must_use]
    pub fn within(self, what: String) -> Self {
        Self { exit: self.exit, error: self.error.context(what) }
    }

    /// "error: …" and a line for each cause that says more than the line before.
    pub fn report(&self) -> String {
        let mut text = format!("error: {}", self.error);
        for cause in self.error.chain().skip(1).map(ToString::to_string) {
            if !text.contains(&cause) {
                let _ = write!(text, "\n  because: {cause}"); // writing to a String cannot fail
            }
        }
        text
    }
}

/// Names the exit code of an error where it leaves the library that knows its kind.
pub trait OrExit<T> {
    /// Turns the error into a [`Failure`] with this code.
    fn or_exit(self, exit: Exit) -> Result<T, Failure>;
}

impl<T, E: Into<anyhow::Error>> OrExit<T> for Result<T, E> {
    fn or_exit(self, exit: Exit) -> Result<T, Failure> {
        self.map_err(|error| Failure::new(exit, error))
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::new(Exit::Io, error)
    }
}

impl From<MetricsError> for Failure {
    fn from(error: MetricsError) -> Self {
        Self::new(Exit::BadInput, error)
    }
}

impl From<CheckpointError> for Failure {
    fn from(error: CheckpointError) -> Self {
        let exit = match &error {
            CheckpointError::Read { source, .. } if source.kind() == io::ErrorKind::NotFound => {
                Exit::BadInput
            }
            CheckpointError::Read { .. } | CheckpointError::Write(_) => Exit::Io,
            CheckpointError::Foreign { .. } | CheckpointError::Damaged { .. } => Exit::BadInput,
            CheckpointError::Schema { .. } => Exit::BadInput,
        };
        Self::new(exit, error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::{Context, anyhow};

    #[test]
    fn report_gives_each_cause_once() {
        let inner = anyhow!("No space left on device").context("cannot write run/a.png");
        let failure = Failure::new(Exit::Io, inner.context("the render of a.png was not saved"));
        assert_eq!(
            failure.report(),
            "error: the render of a.png was not saved\n  because: cannot write run/a.png\n  \
             because: No space left on device"
        );
        let source = io::Error::other("disk on fire");
        let write = WriteError { path: "x".into(), action: "writing", source };
        assert_eq!(Failure::from(write).report().matches("disk on fire").count(), 1);
    }

    #[test]
    fn missing_checkpoint_is_bad_input_but_a_failed_write_is_not() {
        let read = |kind: io::ErrorKind| CheckpointError::Read { path: "x".into(), source: kind.into() };
        assert_eq!(Failure::from(read(io::ErrorKind::NotFound)).exit, Exit::BadInput);
        assert_eq!(Failure::from(read(io::ErrorKind::PermissionDenied)).exit, Exit::Io);
        let source = io::ErrorKind::StorageFull.into();
        assert_eq!(Failure::from(WriteError { path: "x".into(), action: "a", source }).exit, Exit::Io);
    }

    #[test]
    fn any_error_takes_the_code_it_is_given() {
        let result: Result<(), _> = Err(anyhow!("loss is NaN")).context("step 12").or_exit(Exit::Numerical);
        assert_eq!(result.unwrap_err().exit as u8, 5);
    }
}
