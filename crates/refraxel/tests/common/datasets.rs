//! Tiny datasets.

use super::files::write_image;
use refraxel_data::synth::{Elevations, SynthOptions, ViewCounts, cameras, opengl_matrix, synthesize};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A glass ball with truth and masks: 5 training, 1 validation and 2 test views of 16 × 16 pixels.
pub fn ball(folder: &Path) -> PathBuf {
    let out = folder.join("ball");
    let views = ViewCounts { train: 5, val: 1, test: 2 };
    let usual = SynthOptions::new("glass_ball", &out);
    let options = SynthOptions { size: 16, views, spp: 1, detail_spp: 0, index_resolution: 0, ..usual };
    synthesize(&options, &|_| ControlFlow::Continue(())).unwrap();
    out
}

/// A folder with the same ball, and the path `name` beside it.
pub fn ball_and(name: &str) -> (TempDir, PathBuf, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let (data, beside) = (ball(folder.path()), folder.path().join(name));
    (folder, data, beside)
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
