//! Tiny datasets, and the built program run on them.
#![allow(dead_code)] // each test file uses its part

#[cfg(unix)]
pub mod running;

use refraxel_data::synth::{Elevations, SynthOptions, ViewCounts, cameras, opengl_matrix, synthesize};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

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
    let mut command = Command::new(env!("CARGO_BIN_EXE_refraxel"));
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

pub fn path(p: &Path) -> &str {
    p.to_str().unwrap()
}

/// A glass ball with truth and masks: 5 training, 1 validation and 2 test views of 16 × 16 pixels.
pub fn ball(folder: &Path) -> PathBuf {
    let out = folder.join("ball");
    let views = ViewCounts { train: 5, val: 1, test: 2 };
    let usual = SynthOptions::new("glass_ball", &out);
    let options = SynthOptions { size: 16, views, spp: 1, detail_spp: 0, index_resolution: 0, ..usual };
    synthesize(&options, &|_| ControlFlow::Continue(())).unwrap();
    out
}

/// The same ball in enough views for its hull and its index: 30 training views of 40 × 40 pixels.
pub fn glass(folder: &Path) -> PathBuf {
    refractive(folder, "glass_ball", 30, 40)
}

/// A scene in so many training views of `size` × `size` pixels.
pub fn refractive(folder: &Path, scene: &str, train: usize, size: u32) -> PathBuf {
    let out = folder.join(scene);
    let views = ViewCounts { train, val: 0, test: 3 };
    let usual = SynthOptions::new(scene, &out);
    let options = SynthOptions { size, views, spp: 4, detail_spp: 0, index_resolution: 0, ..usual };
    synthesize(&options, &|_| ControlFlow::Continue(())).unwrap();
    out
}

/// A `transforms.json` with images in a folder of its own, changed by `edit` before it is written.
pub fn photographs(count: usize, edit: impl FnOnce(&mut Value)) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(Elevations::UPPER, count, 1, [16, 16]);
    let frame = |(i, c)| json!({ "file_path": format!("r_{i}.png"), "transform_matrix": opengl_matrix(c) });
    let frames: Vec<Value> = cameras.iter().enumerate().map(frame).collect();
    let mut value = json!({ "fl_x": 22.0, "fl_y": 22.0, "w": 16, "h": 16, "frames": frames });
    edit(&mut value);
    std::fs::write(folder.path().join("transforms.json"), value.to_string()).unwrap();
    for i in 0..count {
        write_image(&folder.path().join(format!("r_{i}.png")), 16, 16);
    }
    folder
}

pub fn write_image(path: &Path, width: u32, height: u32) {
    let pixel = |x: u32, y: u32| image::Rgb([(x * 15) as u8, (y * 15) as u8, 90]);
    image::RgbImage::from_fn(width, height, pixel).save(path).unwrap();
}

/// No file lies in the folder or below it.
pub fn is_without_files(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return true };
    entries.map(|e| e.unwrap().path()).all(|p| p.is_dir() && is_without_files(&p))
}
