//! Trainings as programs of their own, and what they leave behind.

use anyhow::{Context, bail, ensure};
use refraxel_data::synth::{SynthOptions, ViewCounts, synthesize};
use refraxel_train::checkpoint::TensorFile;
use refraxel_train::run::CHECKPOINT;
use std::fs::{self, File};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// The refraxel program: the one that is named, or the one beside this program.
pub fn program(named: Option<&Path>) -> anyhow::Result<PathBuf> {
    if let Some(path) = named {
        return Ok(path.to_owned());
    }
    let beside = std::env::current_exe()?.with_file_name("refraxel");
    ensure!(beside.is_file(), "there is no {}; build it, or name one with --program", beside.display());
    Ok(beside)
}

/// A glass ball to train on.
pub fn glass_ball(out: &Path, size: u32, train: usize) -> anyhow::Result<()> {
    let views = ViewCounts { train, val: 1, test: 2 };
    let usual = SynthOptions::new("glass_ball", out);
    let options = SynthOptions { size, views, spp: 4, detail_spp: 0, index_resolution: 0, ..usual };
    synthesize(&options, &|_| ControlFlow::Continue(()))?;
    Ok(())
}

/// What is trained, and how.
#[derive(Clone, Debug)]
pub struct Training {
    /// The program.
    pub program: PathBuf,
    /// Its dataset.
    pub data: PathBuf,
    /// `section.key=value`.
    pub settings: Vec<String>,
    /// Threads.
    pub threads: usize,
}

/// How long a training that was asked to stop, or that has nothing left to do, may take.
pub const PATIENCE: Duration = Duration::from_secs(300);

impl Training {
    /// Starts it in a folder; it goes on where there is a checkpoint.
    pub fn start(&self, run: &Path) -> anyhow::Result<Running> {
        let errors = run.with_extension("stderr");
        let mut command = Command::new(&self.program);
        command.arg("train").arg(&self.data).arg("--out").arg(run).args(["--quiet", "--refraction", "on"]);
        command.args(["--threads", &self.threads.to_string()]);
        command.args(self.settings.iter().flat_map(|setting| ["--set", setting]));
        if run.join(CHECKPOINT).exists() {
            command.arg("--resume");
        } else if run.exists() {
            command.arg("--overwrite");
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(File::create(&errors)?);
        let child = command.spawn().with_context(|| format!("cannot start {}", self.program.display()))?;
        Ok(Running { child, errors })
    }
}

/// A training under way; it does not outlive this.
pub struct Running {
    child: Child,
    errors: PathBuf,
}

impl Running {
    /// Its process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Whether it has ended, and how.
    pub fn ended(&mut self) -> anyhow::Result<Option<ExitStatus>> {
        Ok(self.child.try_wait()?)
    }

    /// Waits for so long; `None` when it is still under way.
    pub fn wait(&mut self, time: Duration) -> anyhow::Result<Option<ExitStatus>> {
        let end = Instant::now() + time;
        loop {
            let status = self.ended()?;
            if status.is_some() || Instant::now() >= end {
                return Ok(status);
            }
            std::thread::sleep(Duration::from_millis(5).min(time));
        }
    }

    /// Waits for its end.
    pub fn finish(&mut self) -> anyhow::Result<ExitStatus> {
        let Some(status) = self.wait(PATIENCE)? else { bail!("the training hangs") };
        Ok(status)
    }

    /// As `kill -9` does.
    pub fn kill(&mut self) -> anyhow::Result<()> {
        self.child.kill()?;
        self.child.wait()?;
        Ok(())
    }

    /// Sends `INT` or `TERM`.
    pub fn send(&self, signal: &str) -> anyhow::Result<()> {
        let sent = Command::new("sh")
            .args(["-c", &format!("kill -{signal} {}", self.id())])
            .stderr(Stdio::null())
            .status();
        sent.context("cannot run `sh`")?; // it may have ended meanwhile
        Ok(())
    }

    /// What it has said on standard error.
    pub fn said(&self) -> String {
        fs::read_to_string(&self.errors).unwrap_or_default()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill(); // it may have ended
        let _ = self.child.wait();
    }
}

/// The step at which a checkpoint was saved; an error where it cannot be read completely.
pub fn step(run: &Path) -> anyhow::Result<u64> {
    let file = TensorFile::load(&run.join(CHECKPOINT))?;
    file.header["state"]["step"].as_u64().context("a checkpoint without a step")
}

/// In what two checkpoints differ beside the time they took and the step at which they were to stop; empty when they are the same
/// bit by bit.
pub fn differences(a: &Path, b: &Path) -> anyhow::Result<Vec<String>> {
    let [a, b] = [a, b].map(|run| TensorFile::load(&run.join(CHECKPOINT)));
    let (mut a, mut b) = (a?, b?);
    for header in [&mut a.header, &mut b.header] {
        header["state"]["seconds"] = 0.into();
        if let Some(run) = header["options"].get_mut("run").filter(|r| r.is_object()) {
            run["stop_after"] = 0.into();
        }
        if let Some(verdict) = header["state"].get_mut("verdict").filter(|v| v.is_object()) {
            verdict["seconds"] = 0.into();
        }
    }
    let mut found = Vec::new();
    if a.header != b.header {
        found.push("the description".to_owned());
    }
    if a.tensors.keys().ne(b.tensors.keys()) {
        found.push("the names of tensors".to_owned());
    }
    let differs = |name: &&String| a.tensors.get(*name) != b.tensors.get(*name);
    found.extend(a.tensors.keys().filter(differs).cloned());
    Ok(found)
}

/// Temporary files in the folder of a run, and its lock.
pub fn leftovers(run: &Path) -> usize {
    let names = fs::read_dir(run).into_iter().flatten().flatten().map(|e| e.file_name());
    names.filter(|n| n.to_str().is_some_and(|n| n.ends_with(".tmp") || n == "training.lock")).count()
}
