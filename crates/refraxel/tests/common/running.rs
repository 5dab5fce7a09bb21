//! Programs that run while a test looks at what they leave behind.

use super::program::Ran;
use refraxel_train::checkpoint::TensorFile;
use refraxel_train::run::CHECKPOINT;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub const LOCK: &str = "training.lock";
/// Time in which everything happens even on a busy machine; a test that waits in vain fails.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// A program that does not outlive its test.
pub struct Running(pub Child);

impl Running {
    pub fn start(command: &mut Command) -> Self {
        Self(command.stdout(Stdio::null()).spawn().unwrap())
    }

    pub fn has_ended(&mut self) -> bool {
        self.0.try_wait().unwrap().is_some()
    }

    pub fn ended(mut self) -> Ran {
        let mut err = String::new();
        if let Some(told) = &mut self.0.stderr {
            told.read_to_string(&mut err).unwrap();
        }
        Ran { code: self.code(), out: String::new(), err }
    }

    /// Waits for its end: the code with which it ends, −1 after a signal.
    pub fn code(&mut self) -> i32 {
        self.0.wait().unwrap().code().unwrap_or(-1)
    }

    /// As `kill -9` does.
    pub fn kill(mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
    }
}

pub fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Sends signals, one right after the other.
pub fn send(child: &Running, signals: &[&str]) {
    let kill = |signal: &&str| format!("kill -{signal} {}", child.0.id());
    let script = signals.iter().map(kill).collect::<Vec<_>>().join(" && ");
    assert!(Command::new("sh").args(["-c", &script]).status().unwrap().success());
}

/// The step at which a run was saved.
pub fn step(run: &Path) -> u64 {
    TensorFile::load(&run.join(CHECKPOINT)).unwrap().header["state"]["step"].as_u64().unwrap()
}

/// Whether a lock or a temporary file is left in a run.
pub fn has_leftovers(run: &Path) -> bool {
    let names = fs::read_dir(run).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
    names.into_iter().any(|name| name == LOCK || name.ends_with(".tmp"))
}
