//! Runs on one ball, each trained once: tests look at them and change nothing but files that no other test looks at.

use crate::common::*;
use refraxel_train::run::CHECKPOINT;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, OnceLock};
use tempfile::TempDir;

static FOLDER: LazyLock<TempDir> = LazyLock::new(|| tempfile::tempdir().unwrap());

/// The ball.
pub fn data() -> &'static Path {
    static DATA: OnceLock<PathBuf> = OnceLock::new();
    DATA.get_or_init(|| ball(FOLDER.path()))
}

/// A run whose index and shape were given.
pub fn bent() -> &'static Path {
    static RUN: OnceLock<PathBuf> = OnceLock::new();
    RUN.get_or_init(|| {
        let run = FOLDER.path().join("bent");
        train_with_index(data(), &run, &data().join("scene.json"), &[]);
        run
    })
}

/// A run with straight rays.
pub fn straight() -> &'static Path {
    static RUN: OnceLock<PathBuf> = OnceLock::new();
    RUN.get_or_init(|| {
        let run = FOLDER.path().join("straight");
        train(data(), &run, &["--refraction", "off"]).done();
        run
    })
}

/// The checkpoint of a run in a folder of its own, and its path.
pub fn copy_of(run: &Path) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let copy = folder.path().join(CHECKPOINT);
    std::fs::copy(run.join(CHECKPOINT), &copy).unwrap();
    (folder, copy)
}
