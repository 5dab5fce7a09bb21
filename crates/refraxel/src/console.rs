//! Standard output: sentences for people, or one JSON document for programs, never both.

use std::io::{self, Write};

use serde::Serialize;

/// What standard output carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Console {
    /// Sentences and tables.
    Text,
    /// One JSON document, by [`Console::result`].
    Json,
}

impl Console {
    /// By the verb's `--json`.
    pub fn new(json: bool) -> Self {
        if json { Self::Json } else { Self::Text }
    }

    /// Prints a line for people; nothing when the output is JSON.
    pub fn say(self, text: &str) -> io::Result<()> {
        match self {
            Self::Text => print(text),
            Self::Json => Ok(()),
        }
    }

    /// Prints the result of the verb in the form that was asked for.
    pub fn result(self, text: &str, value: &impl Serialize) -> io::Result<()> {
        match self {
            Self::Text => print(text),
            Self::Json => print(&serde_json::to_string_pretty(value)?),
        }
    }
}

/// A reader that has gone away, as in `refraxel inspect x | head`, is no failure.
fn print(text: &str) -> io::Result<()> {
    match writeln!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written,
    }
}
