//! The built program, and what it did.

use super::files::path;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// Options that make training a matter of a second, with a cut-off at which some cells soon count as empty.
pub const TINY: [&str; 8] =
    ["--set", "steps=40", "--set", "grid.resolution=16", "--set", "batch=256", "--set", "sh_degree=1"];

/// What the program did.
pub struct Ran {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl Ran {
    pub fn of(output: Output) -> Self {
        let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
        Self { code: output.status.code().unwrap_or(-1), out: text(output.stdout), err: text(output.stderr) }
    }

    /// The program ended well.
    pub fn done(self) -> Self {
        assert_eq!(self.code, 0, "{}", self.err);
        self
    }

    /// The program refused with this code and one message that contains all of `words`.
    pub fn refused(self, code: i32, words: &[&str]) -> Self {
        assert_eq!(self.code, code, "{}", self.err);
        assert_eq!(self.err.matches("error:").count(), 1, "{}", self.err);
        assert!(!self.err.contains("panicked"), "{}", self.err);
        for word in words {
            assert!(self.err.contains(word), "{word:?} is not in: {}", self.err);
        }
        self
    }

    pub fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("{e}: {}", self.out))
    }
}

pub fn command(words: &[&str]) -> Command {
    // On a machine that has not built it, somebody says where it is.
    let built = || env!("CARGO_BIN_EXE_refraxel").into();
    let mut command = Command::new(std::env::var_os("REFRAXEL").unwrap_or_else(built));
    command.args(words);
    // Without one, Mesa's Vulkan layer that chooses a device complains on standard error.
    command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
    command
}

pub fn refraxel(words: &[&str]) -> Ran {
    Ran::of(command(words).output().unwrap())
}

/// Trains quietly with the tiny options and `more`.
pub fn train(data: &Path, out: &Path, more: &[&str]) -> Ran {
    let mut words = vec!["train", path(data), "--out", path(out), "--quiet"];
    words.extend(TINY);
    words.extend(more);
    refraxel(&words)
}

/// Trains a run on the ball whose index comes from `file` and stays.
pub fn train_with_index(data: &Path, out: &Path, file: &Path, more: &[&str]) {
    let fixed = ["--refraction", "on", "--index-from", path(file), "--set", "index.rate=0"];
    train(data, out, &[&fixed[..], &["--set", "surface.rate=0"], more].concat()).done();
}
