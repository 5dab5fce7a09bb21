//! Datasets on disk: layout, repeatability, interruption, bad arguments.

use crate::fixture::{contents, go_on};
use refraxel_data::synth::{Progress, SynthError, SynthOptions, ViewCounts, synthesize};
use serde_json::Value;
use std::fs;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

fn small(scene: &str, out: &Path) -> SynthOptions {
    SynthOptions {
        size: 20,
        views: ViewCounts { train: 3, val: 1, test: 2 },
        spp: 4,
        detail_spp: 9,
        index_resolution: 16,
        exr: true,
        ..SynthOptions::new(scene, out)
    }
}

#[test]
fn synth_writes_the_layout_that_it_documents() {
    let folder = tempfile::tempdir().unwrap();
    let summary = synthesize(&small("glass_ball", folder.path()), &go_on).unwrap();
    assert_eq!((summary.rendered, summary.kept), (8, 0));
    let files = contents(folder.path());
    for name in [
        "transforms_train.json",
        "transforms_val.json",
        "transforms_test.json",
        "transforms_test_bg.json",
        "scene.json",
        "index.npz",
        "contact.png",
        "manifest.json",
        "train/r_2.png",
        "val/r_0.png",
        "test/r_1.png",
        "test_bg/r_1.png",
        "masks/train/r_0.png",
        "depth/val/r_0.png",
        "normals/test/r_0.png",
        "exr/train/r_1.exr",
    ] {
        assert!(files.contains_key(name), "{name} is missing");
    }
    assert!(files.keys().all(|name| !name.ends_with(".tmp")));
    let transforms: Value = serde_json::from_slice(&files["transforms_train.json"]).unwrap();
    assert_eq!(transforms["frames"].as_array().unwrap().len(), 3);
    assert_eq!(transforms["frames"][1]["file_path"], "./train/r_1");
    assert_eq!(transforms["background"], serde_json::json!([255, 255, 255]));
    let twins: Value = serde_json::from_slice(&files["transforms_test_bg.json"]).unwrap();
    assert_eq!(twins["frames"][0]["file_path"], "./test_bg/r_0");
    let depth = image::load_from_memory(&files["depth/test/r_0.png"]).unwrap();
    assert_eq!(depth.color(), image::ColorType::L16);
    let middle = f64::from(depth.to_luma16().get_pixel(10, 10).0[0]) * 1e-4;
    assert!((3.0..4.2).contains(&middle), "the ball is {middle} away");
    let exr = image::load_from_memory(&files["exr/test/r_0.exr"]).unwrap().to_rgb32f();
    assert_eq!(exr.get_pixel(0, 0).0, [1.0; 3], "the background is white");
}

#[test]
fn synth_same_options_give_the_same_bytes_on_any_number_of_threads() {
    let [a, b] = [1, 2].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        synthesize(&SynthOptions { threads: Some(threads), ..small("hollow_ball", folder.path()) }, &go_on)
            .unwrap();
        contents(folder.path())
    });
    assert!(a == b);
}

#[test]
fn synth_a_stopped_run_goes_on_where_it_stopped() {
    let (whole, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    synthesize(&small("two_indices", whole.path()), &go_on).unwrap();
    let options = SynthOptions { threads: Some(1), ..small("two_indices", folder.path()) };
    let seen = AtomicUsize::new(0);
    let stop = |_: Progress| {
        if seen.fetch_add(1, Ordering::Relaxed) == 2 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let error = synthesize(&options, &stop).unwrap_err();
    assert!(matches!(error, SynthError::Stopped { done: 3, total: 8 }), "{error}");
    assert!(!folder.path().join("transforms_train.json").exists(), "an unfinished folder is no dataset");
    let summary = synthesize(&options, &go_on).unwrap();
    assert_eq!((summary.rendered, summary.kept), (5, 3));
    assert!(contents(whole.path()) == contents(folder.path()));
    assert_eq!(synthesize(&options, &go_on).unwrap().rendered, 0);
}

#[test]
fn synth_other_options_replace_the_dataset_without_leftovers() {
    let (fresh, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    synthesize(&small("glass_ball", folder.path()), &go_on).unwrap();
    let fewer = |out| SynthOptions {
        views: ViewCounts { train: 1, val: 0, test: 1 },
        exr: false,
        ..small("opaque", out)
    };
    synthesize(&fewer(folder.path()), &go_on).unwrap();
    synthesize(&fewer(fresh.path()), &go_on).unwrap();
    assert!(contents(fresh.path()) == contents(folder.path()));
}

#[test]
fn synth_a_dataset_from_elsewhere_is_not_touched() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("transforms_train.json"), "{}").unwrap();
    let error = synthesize(&small("glass_ball", folder.path()), &go_on).unwrap_err();
    assert!(matches!(error, SynthError::Foreign { .. }), "{error}");
    assert_eq!(contents(folder.path()).len(), 1);
}

#[test]
fn synth_bad_arguments_end_in_one_clear_message() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let message = |options: SynthOptions| synthesize(&options, &go_on).unwrap_err().to_string();
    let base = || small("glass_ball", &out);
    assert!(
        message(SynthOptions { size: 0, ..base() }).contains("--size is 0, expected a whole number from 1")
    );
    assert!(message(SynthOptions { spp: 0, ..base() }).contains("--spp is 0"));
    assert!(
        message(SynthOptions { views: ViewCounts { train: 0, val: 0, test: 0 }, ..base() })
            .contains("--views is 0")
    );
    assert!(message(SynthOptions { threads: Some(0), ..base() }).contains("--threads is 0"));
    assert!(
        message(SynthOptions { ior: Some(0.5), ..base() })
            .contains("--ior is 0.5, expected a number from 1 to 4")
    );
    assert!(message(small("glas", &out)).contains("no scene \"glas\""));
    assert!(
        message(SynthOptions { mesh: Some("x.obj".into()), ..base() })
            .contains("only glass_mesh takes a mesh")
    );
    let missing = SynthOptions { mesh: Some("missing.obj".into()), ..small("glass_mesh", &out) };
    assert!(message(missing).contains("cannot read missing.obj"));
    assert!(!out.exists(), "nothing was written");
    fs::write(&out, "a file").unwrap();
    assert!(message(base()).contains("cannot create"));
}
