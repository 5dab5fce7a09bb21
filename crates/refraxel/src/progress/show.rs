//! How progress is shown.

use std::io::{self, IsTerminal, Write};

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// A bar that redraws itself.
    Bar,
    /// A line at the start and every ten seconds, for logs.
    Lines,
    /// Nothing.
    Nothing,
}

impl Show {
    /// Nothing when quiet, otherwise what standard error can do.
    pub fn suited(quiet: bool) -> Self {
        if quiet {
            Self::Nothing
        } else if io::stderr().is_terminal() {
            Self::Bar
        } else {
            Self::Lines
        }
    }

    /// Shows one line where no progress is shown yet.
    pub fn say(self, text: &str) {
        if self != Self::Nothing {
            let _ = writeln!(io::stderr(), "{text}"); // what nobody can read is no reason to stop
        }
    }
}
