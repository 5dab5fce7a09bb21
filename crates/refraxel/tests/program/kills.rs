//! A training that is killed and interrupted again and again loses nothing, and ends with the bits of one that nobody disturbed.
#![cfg(unix)] // signals

use crate::common::running::*;
use crate::common::*;
use refraxel_train::checkpoint::TensorFile;
use refraxel_train::run::CHECKPOINT;
use std::path::Path;
use std::process::Stdio;

/// A short run that meets every phase: straight rays, the search, the step to finer grids, joint training. It saves 20 times a second,
/// so that kills meet saves.
const SETTINGS: [&str; 7] = [
    "run.steps=160",
    "run.batch=256",
    "run.save_every=0.05",
    "grid.resolution=32",
    "field.sh_degree=1",
    "straight_steps=40",
    "shape.resolution=16",
];

/// Starts the training, or goes on with it.
fn start(data: &Path, run: &Path) -> Running {
    let mut words =
        vec!["train", path(data), "--out", path(run), "--quiet", "--refraction", "on", "--threads", "1"];
    words.extend(SETTINGS.iter().flat_map(|setting| ["--set", setting]));
    if run.join(CHECKPOINT).exists() {
        words.push("--resume");
    } else if run.exists() {
        words.push("--overwrite");
    }
    Running::start(command(&words).stderr(Stdio::piped()))
}

/// The step of the last save; none before the first one.
fn saved(run: &Path) -> Option<u64> {
    run.join(CHECKPOINT).exists().then(|| step(run))
}

/// All that a run has stored, without the clock.
fn content(run: &Path) -> TensorFile {
    let mut file = TensorFile::load(&run.join(CHECKPOINT)).unwrap();
    file.header["state"]["seconds"] = 0.into();
    if let Some(verdict) = file.header["state"].get_mut("verdict").filter(|v| v.is_object()) {
        verdict["seconds"] = 0.into();
    }
    file
}

#[test]
fn a_training_that_is_killed_and_interrupted_loses_nothing_and_ends_with_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let data = refractive(folder.path(), "glass_ball", 24, 32);
    let [whole, run] = ["whole", "run"].map(|name| folder.path().join(name));
    start(&data, &whole).ended().done();
    // Each end comes as soon as this step is saved by the very process that is ended, so that it listens to signals; the first while
    // photographs are read.
    for (until, signal) in [
        (None, "KILL"),
        (Some(1), "INT"),
        (Some(20), "KILL"),
        (Some(41), "TERM"),
        (Some(80), "KILL"),
        (Some(120), "KILL"),
    ] {
        let before = saved(&run);
        let mut child = start(&data, &run);
        wait_until("the moment comes", || match until {
            None => run.join(LOCK).exists(),
            Some(_) => (saved(&run) >= until && saved(&run) > before) || child.has_ended(),
        });
        if signal == "KILL" || child.has_ended() {
            child.kill();
        } else {
            send(&child, &[signal]);
            let ran = child.ended();
            assert!([0, 130].contains(&ran.code), "{signal} at {until:?}: {}", ran.err);
            assert!(!has_leftovers(&run), "{signal} at {until:?}");
        }
        assert!(
            saved(&run) >= before.max(until),
            "{signal} at {until:?}: {:?} after {before:?}",
            saved(&run)
        );
    }
    start(&data, &run).ended().done();
    assert!(!has_leftovers(&run));
    assert!(content(&run) == content(&whole), "other bits than those of the undisturbed run");
}
