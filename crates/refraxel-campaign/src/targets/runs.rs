//! What a run consists of: checkpoint, log, lock and scores.

use super::small::{TINY, ball};
use super::words::train_args;
use super::{Answer, Target};
use crate::fuzz::{Format, checkpoint};
use refraxel::cli::{CompareArgs, ExportArgs, ExportFormat, SplitName};
use refraxel::exit::{Exit, Failure};
use refraxel::progress::Show;
use refraxel::verbs::{compare, eval, export, train};
use refraxel_train::checkpoint::TensorFile;
use refraxel_train::device::DeviceChoice;
use refraxel_train::run::{CHECKPOINT, Run};
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};

pub fn targets() -> Vec<Target> {
    use Format::{Binary, Checkpoint, Text};
    let target = |name, format, prepare, ask| Target { name, format, prepare, ask };
    vec![
        target("checkpoint-bytes", Binary, |at| finished(at, CHECKPOINT), used),
        target("checkpoint", Checkpoint, |at| finished(at, CHECKPOINT), used),
        target("checkpoint-resume", Checkpoint, interrupted, resumed),
        target("checkpoint-solid", Checkpoint, |at| flattened(at, "solid"), resumed),
        target("checkpoint-cuts", Checkpoint, |at| flattened(at, "cuts"), resumed),
        target("log", Text, |at| interrupted(at).map(|_| at.join("whole/log.jsonl")), resumed),
        target("lock", Text, |at| interrupted(at).map(|_| lock(at)), resumed),
        target("metrics", Text, |at| finished(at, "eval/test/metrics.json"), compared),
    ]
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

/// `refraxel train DATA --out RUN` with the tiny options and more words.
fn trained(data: &Path, run: &Path, more: &[&str]) -> Result<(), Failure> {
    let (data, run) = (text(data), text(run));
    let mut words = vec![data.as_str(), "--out", &run, "--quiet", "--refraction", "on"];
    for setting in TINY {
        words.extend(["--set", setting]);
    }
    words.extend(more);
    let args = train_args(&words).map_err(|error| Failure::new(Exit::Usage, error))?;
    train::train(&args, Show::Nothing).map(drop)
}

fn finished(at: &Path, file: &str) -> anyhow::Result<PathBuf> {
    let (data, run) = (at.join("data"), at.join("run"));
    ball(&data)?;
    trained(&data, &run, &["--overwrite"]).map_err(|f| f.error)?;
    eval::evaluate(&run, SplitName::Test, DeviceChoice::Cpu, Show::Nothing).map_err(|f| f.error)?;
    Ok(run.join(file))
}

/// `whole` stays as it is; what is resumed is a copy.
fn interrupted(at: &Path) -> anyhow::Result<PathBuf> {
    let (data, run) = (at.join("data"), at.join("whole"));
    ball(&data)?;
    let failure = trained(&data, &run, &["--overwrite", "--set", "run.stop_after=3"]).err();
    anyhow::ensure!(failure.is_some_and(|f| f.exit == Exit::Interrupted), "the run was not interrupted");
    Ok(run.join(CHECKPOINT))
}

/// As [`interrupted`]; masks were moved, and the body has flat faces: all of its faces (`solid`), or what planes cut off (`cuts`).
fn flattened(at: &Path, faces: &str) -> anyhow::Result<PathBuf> {
    let path = interrupted(at)?;
    let mut file = TensorFile::load(&path)?;
    file.header["state"]["mask_shift"] = json!(1.5);
    let region = &mut file.header["regions"][0];
    let [min, max]: [[f32; 3]; 2] = serde_json::from_value(region["bounds"].clone())?;
    let plane = |k: usize, sign: f32| {
        let (middle, size) = (0.5 * (min[k] + max[k]), max[k] - min[k]);
        let mut plane = [0.0; 4];
        (plane[k], plane[3]) = (sign, sign * middle + 0.3 * size);
        plane
    };
    let planes: Vec<_> = (0..3).flat_map(|k| [plane(k, -1.0), plane(k, 1.0)]).collect();
    region[faces] = match faces {
        "solid" => json!({ "faces": planes[1..], "base": planes[0] }),
        _ => json!(planes),
    };
    fs::write(&path, checkpoint::written(&file)?)?;
    Ok(path)
}

fn lock(at: &Path) -> PathBuf {
    let path = at.join("whole/training.lock");
    let _ = fs::write(&path, "{\"pid\": 4242, \"host\": \"elsewhere\", \"since\": 1700000000}\n"); // looked at next
    path
}

fn refused(failure: &Failure) -> Answer {
    match failure.exit {
        Exit::Usage | Exit::BadInput | Exit::Numerical => Answer::Refused(failure.report()),
        _ => Answer::Broken(format!("exit {:?}: {}", failure.exit, failure.report())),
    }
}

/// The run is read, scored, exported.
fn used(folder: &Path, _file: &Path) -> Answer {
    let run = folder.join("run");
    if let Err(error) = Run::load(&run) {
        return Answer::Refused(error.to_string());
    }
    if let Err(failure) = eval::evaluate(&run, SplitName::Test, DeviceChoice::Cpu, Show::Nothing) {
        return refused(&failure);
    }
    let out = Some(folder.join("surface.ply"));
    match export::run(&ExportArgs { run, format: ExportFormat::Ply, out, points: 0, detail: 1, json: true }) {
        Ok(()) => Answer::Used,
        Err(failure) => refused(&failure),
    }
}

/// The run goes on to its end, and what it saves can be read.
fn resumed(folder: &Path, _file: &Path) -> Answer {
    let (whole, run) = (folder.join("whole"), folder.join("run"));
    if let Err(error) = copied(&whole, &run) {
        return Answer::Broken(format!("the campaign cannot copy the run: {error}"));
    }
    if let Err(failure) = trained(&folder.join("data"), &run, &["--resume"]) {
        return refused(&failure);
    }
    match Run::load(&run) {
        Ok(_) => Answer::Used,
        Err(error) => Answer::Broken(format!("accepted, then its own checkpoint: {error}")),
    }
}

fn copied(from: &Path, to: &Path) -> std::io::Result<()> {
    if to.exists() {
        fs::remove_dir_all(to)?;
    }
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)?.flatten().filter(|e| e.path().is_file()) {
        fs::copy(entry.path(), to.join(entry.file_name()))?;
    }
    Ok(())
}

fn compared(folder: &Path, _file: &Path) -> Answer {
    let run = folder.join("run");
    let args = CompareArgs {
        runs: vec![run.clone(), run],
        truth: true,
        out: Some(folder.join("compared")),
        wipe: None,
        view: None,
        json: true,
    };
    match compare::run(&args) {
        Ok(()) => Answer::Used,
        Err(failure) => refused(&failure),
    }
}
