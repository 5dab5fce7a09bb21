//! The files of a run: checkpoint, log, lock and scores.

use crate::common::*;
use crate::damage::{Kind, damage, for_each_case};
use crate::forged::{forged, forgeries, written};
use refraxel_train::checkpoint::TensorFile;
use refraxel_train::run::CHECKPOINT;
use serde_json::json;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Options with which rays bend after a moment.
const MOMENT: [&str; 11] = [
    "run.steps=4",
    "run.batch=64",
    "run.stop_after=0",
    "grid.resolution=12",
    "grid.stages=1",
    "field.sh_degree=1",
    "straight_steps=1",
    "shape.resolution=16",
    "search.enabled=off",
    "judge.enabled=off",
    "detection.enabled=off",
];

fn trained(data: &Path, run: &Path, more: &[&str]) -> Ran {
    let mut words =
        vec!["train", path(data), "--out", path(run), "--quiet", "--refraction", "on", "--threads", "1"];
    words.extend(MOMENT.iter().flat_map(|setting| ["--set", setting]));
    words.extend(more);
    refraxel(&words)
}

/// A run that was stopped one step before its end, and a place for copies of it.
struct Interrupted {
    _folder: TempDir,
    data: PathBuf,
    whole: PathBuf,
    copy: PathBuf,
}

impl Interrupted {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (data, whole, copy) =
            (ball(folder.path()), folder.path().join("whole"), folder.path().join("copy"));
        trained(&data, &whole, &["--set", "run.stop_after=3"]).refused(130, &["stopped at step 3 and saved"]);
        Self { _folder: folder, data, whole, copy }
    }

    /// Resumes a copy in which a file has this content. It comes to its end and can be read, or is as it was.
    fn resume_with(&self, name: &str, content: &[u8]) {
        let _ = fs::remove_dir_all(&self.copy); // there is none at first
        fs::create_dir(&self.copy).unwrap();
        for entry in fs::read_dir(&self.whole).unwrap().map(|e| e.unwrap().path()).filter(|p| p.is_file()) {
            fs::copy(&entry, self.copy.join(entry.file_name().unwrap())).unwrap();
        }
        fs::write(self.copy.join(name), content).unwrap();
        let before = fs::read(self.copy.join(CHECKPOINT)).unwrap();
        let ran = trained(&self.data, &self.copy, &["--resume"]);
        let said = ran.err.clone();
        if is_used(ran, &self.copy) {
            let state = TensorFile::load(&self.copy.join(CHECKPOINT)).unwrap().header["state"].clone();
            assert_eq!(state["step"], 4);
            refraxel(&["inspect", path(&self.copy)]).done();
        } else {
            assert!(
                fs::read(self.copy.join(CHECKPOINT)).unwrap() == before,
                "a refused run was changed: {said}"
            );
        }
    }
}

/// Whether the program has used a file, or has refused it by name; nothing else may be.
fn is_used(ran: Ran, file: &Path) -> bool {
    let code = ran.code;
    match code {
        0 => {}
        2 | 3 => drop(ran.refused(code, &[path(file)])),
        5 => drop(ran.refused(5, &[])), // it could not go on from there
        _ => panic!("exit code {code}: {}", ran.err),
    }
    code == 0
}

/// Gives all faces of the body, or what cuts it, to planes around it, and moves the masks.
fn with_planes(mut file: TensorFile, faces: &str) -> TensorFile {
    file.header["state"]["mask_shift"] = json!(1.5);
    let region = &mut file.header["regions"][0];
    let [min, max]: [[f32; 3]; 2] = serde_json::from_value(region["bounds"].clone()).unwrap();
    let plane = |k: usize, sign: f32| {
        let mut plane = [0.0; 4];
        (plane[k], plane[3]) = (sign, sign * 0.5 * (min[k] + max[k]) + 0.3 * (max[k] - min[k]));
        plane
    };
    let planes: Vec<_> = (0..3).flat_map(|k| [plane(k, -1.0), plane(k, 1.0)]).collect();
    region[faces] = match faces {
        "solid" => json!({ "faces": planes[1..], "base": planes[0] }),
        _ => json!(planes),
    };
    file
}

#[test]
fn a_run_with_a_forged_checkpoint_is_resumed_to_its_end_or_refused_unchanged() {
    let run = Interrupted::new();
    let whole = TensorFile::load(&run.whole.join(CHECKPOINT)).unwrap();
    let [solid, cut] = ["solid", "cuts"].map(|faces| with_planes(whole.clone(), faces));
    for (name, valid) in [("free surface", whole), ("flat faces", solid), ("cut faces", cut)] {
        run.resume_with(CHECKPOINT, &written(&valid));
        assert!(run.copy.join("eval").exists(), "{name}: the valid one is used");
        for_each_case(name, 16, forgeries(&valid), |forgeries| {
            run.resume_with(CHECKPOINT, &forged(&valid, forgeries));
        });
    }
}

#[test]
fn a_run_with_a_damaged_log_or_lock_is_resumed() {
    let run = Interrupted::new();
    let log = fs::read(run.whole.join("log.jsonl")).unwrap();
    let lock = b"{\"pid\": 4242, \"host\": \"elsewhere\", \"since\": 1700000000}\n";
    for (name, valid) in [("log.jsonl", &log[..]), ("training.lock", lock)] {
        for_each_case(name, 12, damage(Kind::Text), |damage| {
            run.resume_with(name, &damage.of(valid));
            assert!(run.copy.join("eval").exists(), "a run is worth more than its {name}");
        });
    }
}

#[test]
fn a_finished_run_with_forged_files_is_used_or_refused() {
    let (folder, data, run) = ball_and("run");
    trained(&data, &run, &[]).done();
    let scores = run.join("eval/test/metrics.json");
    let valid = fs::read(&scores).unwrap();
    for_each_case("scores", 24, damage(Kind::Text), |damage| {
        fs::write(&scores, damage.of(&valid)).unwrap();
        is_used(refraxel(&["compare", path(&run), path(&run), "--json"]), &run);
    });
    let (file, mesh) = (run.join(CHECKPOINT), folder.path().join("surface.ply"));
    let valid = TensorFile::load(&file).unwrap();
    for_each_case("finished", 24, forgeries(&valid), |forgeries| {
        fs::write(&file, forged(&valid, forgeries)).unwrap();
        is_used(refraxel(&["eval", path(&run), "--quiet", "--threads", "1"]), &run);
        is_used(refraxel(&["export", path(&run), "--format", "ply", "--out", path(&mesh)]), &run);
    });
}

#[test]
fn scores_that_are_no_text_are_bad_input() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    fs::create_dir_all(run.join("eval/test")).unwrap();
    fs::write(run.join("eval/test/metrics.json"), b"{\"run\": \"\xff\"}").unwrap();
    refraxel(&["compare", path(&run)]).refused(3, &["metrics.json"]);
}
