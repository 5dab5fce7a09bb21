//! Programs that run while a test looks at what they leave behind.

use super::program::Ran;
use refraxel_train::checkpoint::TensorFile;
use refraxel_train::run::CHECKPOINT;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

pub const LOCK: &str = "training.lock";
/// Time in which everything happens even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A program that does not outlive its test.
pub struct Running(Option<Child>);

impl Running {
    pub fn start(command: &mut Command) -> Self {
        Self(Some(command.stdout(Stdio::null()).spawn().unwrap()))
    }

    pub fn id(&self) -> u32 {
        self.0.as_ref().unwrap().id()
    }

    pub fn has_ended(&mut self) -> bool {
        self.0.as_mut().unwrap().try_wait().unwrap().is_some()
    }

    pub fn ended(mut self) -> Ran {
        Ran::of(self.0.take().unwrap().wait_with_output().unwrap())
    }

    /// As `kill -9` does.
    pub fn kill(mut self) {
        let mut child = self.0.take().unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        if let Some(child) = &mut self.0 {
            let _ = child.kill();
        }
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
    let kill = |signal: &&str| format!("kill -{signal} {}", child.id());
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
