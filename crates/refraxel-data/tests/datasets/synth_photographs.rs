//! Photographs of rooms: layout, repeatability, and that each imperfection changes its own thing only.

use crate::fixture::{contents, go_on};
use refraxel_data::synth::{Imperfection, Imperfections, SynthOptions, TURN_ERROR, ViewCounts, synthesize};
use refraxel_data::{Backdrop, Dataset, OpenOptions, Severity, report};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

type Files = BTreeMap<String, Vec<u8>>;

fn small(room: &str, out: &Path) -> SynthOptions {
    SynthOptions {
        size: 48,
        views: ViewCounts { train: 6, val: 0, test: 2 },
        spp: 4,
        index_resolution: 8,
        ..SynthOptions::photographs(room, out)
    }
}

/// All files that a run writes.
fn files(edit: impl Fn(SynthOptions) -> SynthOptions) -> Files {
    let folder = tempfile::tempdir().unwrap();
    synthesize(&edit(small("terrace_ball", folder.path())), &go_on).unwrap();
    contents(folder.path())
}

fn without(list: &[Imperfection]) -> Files {
    let with = list.iter().fold(Imperfections::ALL, |rest, &one| rest.without(one));
    files(|o| SynthOptions { photographic: Some(with), ..o })
}

/// Kinds of files that differ; the lists of what was done apart.
fn differing(a: &Files, b: &Files) -> BTreeSet<String> {
    let names: BTreeSet<&String> = a.keys().chain(b.keys()).collect();
    let kind = |name: &str| name.rsplit_once('/').map_or(name, |(folder, _)| folder).to_owned();
    let differs = |name: &&&String| a.get(**name) != b.get(**name);
    let all = names.iter().filter(differs).map(|name| kind(name));
    all.filter(|kind| !["manifest.json", "photographs.json"].contains(&kind.as_str())).collect()
}

fn set(kinds: &[&str]) -> BTreeSet<String> {
    kinds.iter().map(|&k| k.to_owned()).collect()
}

fn frames(files: &Files, name: &str) -> Vec<Value> {
    let json: Value = serde_json::from_slice(&files[name]).unwrap();
    json["frames"].as_array().unwrap().clone()
}

/// Mean of all values of a picture.
fn mean(picture: &[u8]) -> f64 {
    let pixels = image::load_from_memory(picture).unwrap().into_rgb8().into_raw();
    pixels.iter().map(|&v| f64::from(v)).sum::<f64>() / pixels.len() as f64
}

#[test]
fn photographs_have_the_same_bytes_on_any_number_of_threads_and_others_for_another_seed() {
    let on = |threads, seed| files(move |o| SynthOptions { threads: Some(threads), seed, ..o });
    let (a, b, other) = (on(1, 3), on(2, 3), on(2, 4));
    assert!(a == b);
    assert!(a.keys().filter(|n| n.ends_with(".jpg")).all(|n| a[n] != other[n]));
}

#[test]
fn each_imperfection_changes_its_own_thing_only() {
    let all = without(&[]);
    let cases = [
        (Imperfection::Exposure, set(&["train", "test"])),
        (Imperfection::Noise, set(&["train", "test"])),
        (Imperfection::Focus, set(&["train", "test", "masks/test"])),
        (Imperfection::Poses, set(&["transforms.json", "transforms_train.json", "transforms_test.json"])),
        (Imperfection::Masks, set(&["masks/train", "transforms.json", "transforms_train.json"])),
    ];
    for (one, expected) in cases {
        let found = differing(&all, &without(&[one]));
        // The contact sheet shows the room without imperfections.
        assert_eq!(found, expected, "{}", one.name());
    }
}

#[test]
fn photographs_without_jpeg_are_png_and_differ_little() {
    let (all, plain) = (without(&[]), without(&[Imperfection::Jpeg]));
    assert!(plain.contains_key("train/r_0.png") && !plain.contains_key("train/r_0.jpg"));
    assert!((mean(&all["train/r_0.jpg"]) - mean(&plain["train/r_0.png"])).abs() < 0.5);
}

#[test]
fn noise_leaves_the_mean_of_a_photograph_and_exposure_does_not() {
    let exact = without(&Imperfection::ALL);
    let noisy =
        without(&Imperfection::ALL.into_iter().filter(|&i| i != Imperfection::Noise).collect::<Vec<_>>());
    let lit =
        without(&Imperfection::ALL.into_iter().filter(|&i| i != Imperfection::Exposure).collect::<Vec<_>>());
    let names: Vec<&String> = exact.keys().filter(|n| n.starts_with("train/")).collect();
    let off = |of: &Files| names.iter().map(|&n| (mean(&of[n]) - mean(&exact[n])).abs()).fold(0.0, f64::max);
    // A standard error is 3 / 255 over the root of 5184 values; black pixels are clipped.
    assert!(off(&noisy) < 0.4, "{}", off(&noisy));
    assert!(off(&lit) > 1.0, "{}", off(&lit));
}

#[test]
fn stated_poses_are_off_and_the_true_ones_stand_beside_them() {
    let (all, exact) = (without(&[]), without(&[Imperfection::Poses]));
    let matrix =
        |f: &Value| -> [[f64; 4]; 4] { serde_json::from_value(f["transform_matrix"].clone()).unwrap() };
    let (stated, told) = (frames(&all, "transforms.json"), frames(&all, "photographs.json"));
    assert_eq!(frames(&exact, "transforms.json").len(), 8);
    for ((stated, told), exact) in stated.iter().zip(&told).zip(frames(&exact, "transforms.json")) {
        assert_eq!(stated["file_path"], told["file_path"]);
        let (a, b) = (matrix(stated), matrix(told));
        assert_eq!(b, matrix(&exact));
        let trace: f64 =
            (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| a[i][j] * b[i][j]).sum();
        assert!(((0.5 * (trace - 1.0)).acos().to_degrees() - TURN_ERROR).abs() < 1e-5);
    }
}

#[test]
fn the_importer_takes_them_for_photographs_with_surroundings_and_masks_of_glass() {
    let folder = tempfile::tempdir().unwrap();
    synthesize(&small("terrace_ball", folder.path()), &go_on).unwrap();
    let data = Dataset::open(folder.path(), &OpenOptions::default()).unwrap();
    assert_eq!(data.backdrop, Backdrop::Surroundings);
    // So few and small pictures do not tell what masks mean: their coverage does, and a warning says so.
    let is_expected = |message: &str| message.contains("white in the masks");
    let others = data.problems.iter().filter(|p| !is_expected(&p.message));
    assert!(others.clone().all(|p| p.severity == Severity::Note), "{:?}", data.problems);
    let report = report(&data);
    assert!(report.unbounded && report.known_refractive_objects == 1);
    assert_eq!((report.views.train, report.views.test), (6, 2));
    let masks = report.masks.unwrap();
    assert_eq!((masks.meaning, masks.count), ("refractive", 7));
    assert_eq!([data.views[0].camera.width, data.views[0].camera.height], [48, 36]);
}

#[test]
fn a_room_without_glass_has_no_masks() {
    let folder = tempfile::tempdir().unwrap();
    synthesize(&small("study_mirrors", folder.path()), &go_on).unwrap();
    assert!(!folder.path().join("masks").exists());
    let data = Dataset::open(folder.path(), &OpenOptions::default()).unwrap();
    assert!(report(&data).masks.is_none());
}

#[test]
fn rooms_are_photographed_and_other_scenes_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let message = |o: SynthOptions| synthesize(&o, &go_on).unwrap_err().to_string();
    let plain = SynthOptions { photographic: None, ..small("terrace_ball", folder.path()) };
    assert!(message(plain).contains("--photographic is not given, expected it with every room"));
    assert!(message(small("glass_ball", folder.path())).contains("with rooms only"));
    let unknown = message(small("attic", folder.path()));
    assert!(unknown.contains("\"attic\"") && unknown.contains("kitchen_bear"), "{unknown}");
}
