//! A scene far from the origin of its world: what enters and what leaves is in the coordinates of the data.

use crate::common::*;
use refraxel_core::{Vec3, vec3};
use refraxel_data::photographs::stored_pixels;
use refraxel_data::synth::Shape;
use refraxel_data::{OpenOptions, open_cameras, read_mesh};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Where the other scene stands, in metres of UTM.
const UTM: Vec3<f64> = vec3(471_000.25, 5_270_000.5, 530.125);

/// Adds the way to every place below a key.
fn shift(value: &mut Value) {
    let place =
        |list: &Value| list.as_array().is_some_and(|l| l.len() == 3 && l.iter().all(Value::is_number));
    for (key, value) in value.as_object_mut().into_iter().flatten() {
        match key.as_str() {
            "transform_matrix" => {
                (0..3).for_each(|a| value[a][3] = json!(value[a][3].as_f64().unwrap() + UTM[a]))
            }
            "center" if place(value) => {
                (0..3).for_each(|a| value[a] = json!(value[a].as_f64().unwrap() + UTM[a]));
            }
            "frames" | "refractive" => value.as_array_mut().unwrap().iter_mut().for_each(shift),
            "region" | "index" => shift(value),
            _ => {}
        }
    }
}

/// The ball, and the same ball elsewhere.
fn balls(folder: &Path) -> [PathBuf; 2] {
    let far = folder.join("far");
    std::fs::create_dir(&far).unwrap();
    let balls = [ball(folder), ball(&far)];
    for entry in std::fs::read_dir(&balls[1]).unwrap() {
        let file = entry.unwrap().path();
        if file.extension().is_some_and(|e| e == "json") {
            let mut value = json_of(&file);
            shift(&mut value);
            std::fs::write(&file, value.to_string()).unwrap();
        }
    }
    balls
}

/// Three numbers each of a list.
fn places(value: &Value) -> Vec<Vec3<f64>> {
    let corners: Vec<[f64; 3]> = serde_json::from_value(value.clone()).unwrap();
    corners.into_iter().map(Vec3::from).collect()
}

fn assert_shifted(near: &[Vec3<f64>], far: &[Vec3<f64>], most: f64) {
    assert!(!near.is_empty() && near.len() == far.len());
    for (a, b) in near.iter().zip(far) {
        assert!((*b - *a - UTM).length() < most, "{b:?} is not {a:?} elsewhere");
    }
}

#[test]
fn a_run_far_from_the_origin_gives_what_one_near_it_gives_in_the_coordinates_of_its_data() {
    let folder = tempfile::tempdir().unwrap();
    let data = balls(folder.path());
    let inspected = data.each_ref().map(|d| refraxel(&["inspect", path(d), "--json"]).done().json());
    assert_shifted(&places(&inspected[0]["content_box"]), &places(&inspected[1]["content_box"]), 1e-4);
    let said = inspected[1]["problems"].to_string();
    assert!(said.contains("far from the origin"), "{said}");
    let runs = data.each_ref().map(|data| {
        let run = data.join("run");
        let truth = data.join("scene.json");
        let known = ["--refraction", "on", "--index-from", path(&truth), "--set", "shape.resolution=24"];
        train(data, &run, &known).done();
        run
    });
    let scores = runs.each_ref().map(|run| json_of(&run.join("eval/test/metrics.json")));
    for key in ["psnr", "mean_inside", "mae_inside"] {
        let [a, b] = scores.each_ref().map(|s| s.get(key).unwrap_or(&s["ior"][key]).as_f64().unwrap());
        assert!((a - b).abs() < 0.01 * a.abs() + 1e-6, "{key}: {a} {b}");
    }
    let read_as = refraxel(&["inspect", path(&runs[1])]).done().out;
    for said in ["far from the origin", "split      ", "backdrop   "] {
        assert!(read_as.contains(said), "the run keeps what was found in its data: {said} in {read_as}");
    }
    let boxes =
        runs.each_ref().map(|run| places(&refraxel(&["inspect", path(run), "--json"]).done().json()["box"]));
    assert_shifted(&boxes[0], &boxes[1], 1e-4);
    let surfaces = runs.each_ref().map(|run| {
        refraxel(&["export", path(run), "--format", "ply"]).done();
        let bounds = Shape::Mesh(read_mesh(&run.join("surface.ply")).unwrap()).bounds();
        vec![bounds.min, bounds.max]
    });
    assert_shifted(&surfaces[0], &surfaces[1], 1e-4);
    let files = runs.each_ref().map(|run| {
        let file = run.join("learned.json");
        refraxel(&["export", path(run), "--format", "cameras", "--out", path(&file)]).done();
        file
    });
    let options = OpenOptions { allow_outside: true, ..OpenOptions::default() };
    let cameras = files.each_ref().map(|file| open_cameras(file, &options).unwrap());
    let eyes = cameras.each_ref().map(|c| c.iter().map(|c| c.camera.world_from_camera.translation).collect());
    let [near, far]: &[Vec<Vec3<f64>>; 2] = &eyes;
    assert_shifted(near, far, 1e-8);
    // Views from such a file, which is written again beside them.
    let views = [0, 1].map(|k| {
        let out = runs[k].join("views");
        refraxel(&["render", path(&runs[k]), "--cameras", path(&files[k]), "--out", path(&out)]).done();
        out
    });
    let written = views.each_ref().map(|v| open_cameras(v.join("transforms.json"), &options).unwrap());
    assert_eq!(written[1].len(), far.len());
    for (camera, eye) in written[1].iter().zip(far) {
        assert!((camera.camera.world_from_camera.translation - *eye).length() < 1e-8);
    }
    for (near, far) in written[0].iter().zip(&written[1]) {
        let picture = |k: usize, name: &str| {
            stored_pixels(views[k].join(format!("{name}.png"))).unwrap().into_rgb8().into_raw()
        };
        let pictures = [picture(0, &near.name), picture(1, &far.name)];
        let differences = pictures[0].iter().zip(&pictures[1]).map(|(a, b)| u64::from(a.abs_diff(*b)));
        let mean = differences.sum::<u64>() as f64 / pictures[0].len() as f64;
        assert!(mean < 1.0, "{}: {mean}", near.name);
    }
}
