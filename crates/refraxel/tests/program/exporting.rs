//! Surfaces of reconstructions as meshes, and back.

use super::runs::straight;
use crate::common::*;
use flate2::read::GzDecoder;
use refraxel::verbs::loaded::load_run;
use refraxel::verbs::reopen::reopen;
use refraxel_core::{Camera, LevelSet, Vec3};
use refraxel_data::synth::Shape;
use refraxel_data::{Dataset, OpenOptions, Reduction, View, read_mesh};
use refraxel_train::Backend;
use serde_json::Value;
use std::io::Read;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const SHARP: [&str; 6] =
    ["--set", "surface.smooth=0", "--set", "search.profile=sharp", "--set", "shape.resolution=24"];

/// A folder, the ball in it, and a run on the ball whose index and shape come from its scene and stay.
fn sharp(name: &str) -> (TempDir, PathBuf, PathBuf) {
    let (folder, data, run) = ball_and(name);
    train_with_index(&data, &run, &data.join("scene.json"), &SHARP);
    (folder, data, run)
}

fn export(run: &Path, format: &str, more: &[&str]) -> Ran {
    refraxel(&[&["export", path(run), "--format", format], more].concat())
}

fn level_set(run: &Path) -> LevelSet<f64> {
    let run = load_run(run).unwrap();
    run.backend.medium().medium.regions()[0].level_set().unwrap().cast()
}

fn number(report: &Value, key: &str) -> f64 {
    report["regions"][0][key].as_f64().unwrap()
}

#[test]
fn a_ball_leaves_as_a_closed_mesh_of_its_size() {
    let (_folder, data, run) = sharp("run");
    let radius = json_of(&data.join("scene.json"))["refractive"][0]["radius"].as_f64().unwrap();
    let report = export(&run, "ply", &["--json", "--detail", "2"]).done().json();
    let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    assert!((number(&report, "volume") / volume - 1.0).abs() < 0.02, "{report}");
    assert_eq!((number(&report, "bodies"), number(&report, "index")), (1.0, 1.5));
    assert_eq!(report["regions"][0]["boundary"], "jump");
    let mesh = std::fs::read(run.join("surface.ply")).unwrap();
    let header = String::from_utf8_lossy(&mesh[..mesh.len().min(500)]).into_owned();
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"), "{header}");
    let text = export(&run, "ply", &[]).done().out;
    assert!(text.contains("region 1: index 1.500") && text.contains("surface.ply"), "{text}");
}

#[test]
fn a_gltf_file_tells_which_way_was_up() {
    let (folder, data, run) = sharp("run");
    let up = |report: &Value| -> Vec<f64> {
        report["up"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let report = export(&run, "gltf", &["--json"]).done().json();
    let [x, y, z] = up(&report)[..] else { panic!("{report}") };
    assert!(
        z > 0.8 && (x * x + y * y + z * z - 1.0).abs() < 1e-12 && report["up_note"].is_null(),
        "{report}"
    );
    assert!(export(&run, "ply", &["--json"]).done().json()["up"].is_null());
    std::fs::rename(&data, folder.path().join("moved")).unwrap();
    let report = export(&run, "gltf", &["--json"]).done().json();
    assert_eq!(up(&report), [0.0, 0.0, 1.0]);
    assert!(report["up_note"].as_str().unwrap().contains("no such file"), "{report}");
    let text = export(&run, "gltf", &[]).done().out;
    assert!(text.contains("up: (0.000, 0.000, 1.000)") && text.contains("NeRF-synthetic"), "{text}");
}

#[test]
fn a_page_holds_the_scene_and_a_picture_and_a_gltf_file_all_that_stands_around() {
    let (folder, data, run) = sharp("a <b>");
    let report = export(&run, "html", &["--json"]).done().json();
    let page = std::fs::read_to_string(run.join("scene.html")).unwrap();
    assert_eq!(report["bytes"].as_u64(), Some(page.len() as u64));
    let element = |id: &str| {
        let (_, after) = page.split_once(&format!("id=\"{id}\">")).unwrap();
        after.split_once("</script>").unwrap().0.to_owned()
    };
    let document: Value = serde_json::from_str(&element("document")).unwrap();
    assert_eq!(document["name"], "a <b>");
    let region = &document["regions"][0];
    assert_eq!((region["slides"].as_bool(), region["uniform"].as_bool()), (Some(true), Some(true)));
    assert!((region["index"].as_f64().unwrap() - 1.5).abs() < 1e-3, "{region}");
    assert_eq!(document["constants"]["u32"]["BLOCKS"], 3, "four coefficients of each colour");
    assert!(page.contains("data:image/jpeg;base64,/9j/") && element("numbers").starts_with("H4sI"));
    // The same run gives the same bytes; without its photographs, a view of the box.
    export(&run, "html", &["--out", path(&folder.path().join("b.html"))]).done();
    assert_eq!(std::fs::read_to_string(folder.path().join("b.html")).unwrap(), page);
    let scene = export(&run, "blender", &["--json"]).done().json();
    assert_eq!(scene["cameras"], 8);
    let none = export(&run, "gltf", &["--json", "--points", "0"]).done().json();
    assert_eq!(none["points"], 0);
    std::fs::rename(&data, folder.path().join("moved")).unwrap();
    let other = export(&run, "html", &["--json"]).done().json();
    assert_eq!(other["voxels"], report["voxels"]);
}

#[test]
fn a_mesh_that_comes_back_is_the_same_surface() {
    let (folder, data, first) = sharp("first");
    export(&first, "ply", &["--detail", "2"]).done();
    let second = folder.path().join("second");
    train_with_index(&data, &second, &first.join("surface.ply"), &SHARP);
    let (before, after) = (level_set(&first), level_set(&second));
    let mesh = refraxel_core::Mesh::of_level(after.domain(), 1, |x| after.sample(x));
    let mut off: Vec<f64> = mesh.vertices.iter().map(|&x| before.value(x).abs() / before.voxel()).collect();
    off.sort_by(f64::total_cmp);
    let (median, most) = (off[off.len() / 2], off[off.len() - 1]);
    assert!(median < 0.01 && most < 0.05, "median {median}, most {most} voxels");
}

#[test]
fn cameras_that_learned_are_opened_again() {
    let (folder, data, run) = ball_and("run");
    let often = ["--set", "steps=60", "--refraction", "off"]; // poses begin to learn at step 48
    let learn = ["--poses", "learn", "--lens", "learn", "--crop", "1,2,3,4", "--downscale", "2"];
    train(&data, &run, &[&often[..], &learn].concat()).done();
    let file = folder.path().join("transforms.json");
    let report = export(&run, "cameras", &["--out", path(&file), "--json"]).done().json();
    assert_eq!((&report["cameras"], &report["learned"]), (&8.into(), &"poses and lenses as learned".into()));
    export(&run, "cameras", &["--out", path(&file)]).refused(3, &["transforms.json exists", "another name"]);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("\"ball/train/r_0.png\""), "relative to the file's folder: {text}");
    let crop = "1,2,3,4".parse().unwrap();
    let mut again = Dataset::open(&file, &OpenOptions { crop, ..OpenOptions::default() }).unwrap();
    let run = load_run(&run).unwrap();
    let before = reopen(&run).unwrap();
    let split = [&again.split, &before.split].map(|s| (s.train.clone(), s.val.clone(), s.test.clone()));
    assert_eq!(split[0], split[1]);
    assert_eq!(again.backdrop, before.backdrop);
    again.reduce(&(0..8).collect::<Vec<_>>(), Reduction::Divide(2));
    let learned = run.alignment.cameras(&before);
    let moved = |(a, b): (&Camera, &View)| {
        (a.world_from_camera.translation - b.camera.world_from_camera.translation).length()
    };
    assert!(learned.iter().zip(&before.views).take(5).map(moved).fold(0.0, f64::max) > 1e-5);
    for (view, camera) in again.views.iter().zip(&learned) {
        let rays = [&view.camera, camera].map(|c| c.ray(4.5, 1.5).unwrap());
        assert!((rays[0].origin - rays[1].origin).length() < 1e-9, "{}", view.name);
        assert!((rays[0].direction - rays[1].direction).length() < 1e-9, "{}", view.name);
        assert_eq!([view.camera.width, view.camera.height], [6, 5]);
    }
}

#[test]
fn a_straight_run_leaves_as_coloured_meshes_points_and_gaussians() {
    let (folder, run) = (tempfile::tempdir().unwrap(), straight()); // in which something has become opaque
    let ply = export(run, "ply", &["--json"]).done().json();
    assert_eq!(ply["regions"].as_array().map(Vec::len), Some(0));
    let (vertices, faces) = (ply["opaque"]["vertices"].as_u64(), ply["opaque"]["faces"].as_u64().unwrap());
    assert!(faces > 100 && ply["notes"][0].as_str().unwrap().contains("straight"), "{ply}");
    let obj = export(run, "obj", &["--json"]).done().json();
    assert_eq!(obj["opaque"], ply["opaque"]);
    let text = std::fs::read_to_string(run.join("surface.obj")).unwrap();
    assert_eq!(text.lines().filter(|l| l.starts_with("f ")).count() as u64, faces);
    // Its opaque things are no glass.
    for name in ["surface.ply", "surface.obj"] {
        assert!(read_mesh(&run.join(name)).is_err_and(|e| e.to_string().contains("0 triangles")));
    }
    let glb = export(run, "glb", &["--json"]).done().json();
    assert_eq!((&glb["opaque"], &glb["cameras"]), (&ply["opaque"], &Value::from(8)));
    let document = gltf::Gltf::open(run.join("scene.glb")).unwrap();
    let mesh = document.meshes().next().unwrap();
    let primitive = mesh.primitives().next().unwrap();
    let colours = primitive.reader(|_| document.blob.as_deref()).read_colors(0).unwrap();
    assert_eq!((mesh.name(), Some(colours.into_rgb_f32().count() as u64)), (Some("opaque"), vertices));
    let points = export(run, "points", &["--json"]).done().json();
    let file = std::fs::read(run.join("points.ply")).unwrap();
    let end = file.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    assert_eq!(Some((file.len() - end) as u64), points["points"].as_u64().map(|n| 15 * n));
    let splats = export(run, "splats", &["--json", "--points", "40"]).done().json();
    assert_eq!(splats["splats"], 40, "{splats}");
    let file = std::fs::read(run.join("splats.ply")).unwrap();
    let end = file.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    assert_eq!(file.len() - end, 40 * 4 * (3 + 3 + 3 + 9 + 1 + 3 + 4));
    let spz = folder.path().join("scene.spz");
    let report = export(run, "splats", &["--json", "--points", "40", "--out", path(&spz)]).done().json();
    assert!(report["notes"].to_string().contains("SPZ rounds places"), "{report}");
    let mut bytes = Vec::new();
    GzDecoder::new(std::fs::File::open(spz).unwrap()).read_to_end(&mut bytes).unwrap();
    assert_eq!((&bytes[..4], bytes.len()), (&b"NGSP"[..], 16 + 40 * (9 + 1 + 3 + 3 + 3 + 9)));
}

#[test]
fn without_its_photographs_a_run_leaves_its_meshes_and_gaussians_and_says_what_is_less_good() {
    let (folder, data, run) = ball_and("straight");
    train(&data, &run, &["--refraction", "off"]).done();
    std::fs::rename(&data, folder.path().join("moved")).unwrap();
    for format in ["ply", "obj", "gltf", "splats"] {
        let report = export(&run, format, &["--json"]).done().json();
        assert!(report["notes"].to_string().contains("no such file"), "{report}");
    }
    export(&run, "points", &[]).refused(3, &["no such file"]);
}

#[test]
fn a_run_with_glass_leaves_both_what_is_refractive_and_what_is_opaque() {
    let (_folder, _, run) = sharp("run");
    let report = export(&run, "ply", &["--json"]).done().json();
    assert!(
        report["opaque"]["faces"].as_u64() > Some(100) && report["notes"].as_array().unwrap().is_empty(),
        "{report}"
    );
    assert_eq!(report["regions"].as_array().map(Vec::len), Some(1));
    let header = std::fs::read(run.join("surface.ply")).unwrap();
    let header = String::from_utf8_lossy(&header[..500]).into_owned();
    assert!(
        header.contains("comment region 0: opaque\ncomment region 1: index of refraction 1.5\n"),
        "{header}"
    );
    // The middle of the glass is in it; what is opaque is wider, and is not.
    let middle = |mesh: &Value| -> [f64; 3] {
        std::array::from_fn(|a| (0..2).map(|k| 0.5 * mesh["bounds"][k][a].as_f64().unwrap()).sum())
    };
    let low = |mesh: &Value, a: usize| mesh["bounds"][0][a].as_f64().unwrap();
    let (glass, opaque) = (&report["regions"][0], &report["opaque"]);
    let mesh = Shape::Mesh(read_mesh(&run.join("surface.ply")).unwrap());
    assert!(mesh.contains(Vec3::from(middle(glass))));
    assert!(low(opaque, 0) < low(glass, 0) && mesh.bounds().min.x > low(glass, 0) - 1e-6, "{report}");
}

#[test]
fn an_interrupted_run_says_what_to_do() {
    let (folder, data, run) = ball_and("run");
    train(&data, &run, &["--refraction", "off", "--set", "stop_after=1"]).refused(130, &[]);
    for format in ["ply", "obj", "gltf", "glb"] {
        export(&run, format, &[]).refused(3, &["checkpoint.safetensors", "straight", "--index-from"]);
    }
    assert!(!run.join("surface.ply").exists() && !run.join("surface.glb").exists());
    export(&folder.path().join("nowhere"), "ply", &[]).refused(3, &["nowhere"]);
    export(&run, "stl", &[]).refused(2, &["ply", "gltf", "cameras"]);
    export(&run, "ply", &["--detail", "0"]).refused(2, &["--detail"]);
}

#[test]
fn a_failed_export_leaves_the_earlier_file() {
    let (folder, _, run) = sharp("run");
    let absent = folder.path().join("absent").join("a.ply");
    export(&run, "ply", &["--out", path(&absent)]).refused(4, &["absent", "must exist"]);
    let file = folder.path().join("a.glb");
    export(&run, "gltf", &["--out", path(&file)]).done();
    let before = std::fs::read(&file).unwrap();
    // The same run gives the same bytes.
    export(&run, "glb", &["--out", path(&file)]).done();
    assert_eq!(std::fs::read(&file).unwrap(), before);
    std::fs::write(run.join(refraxel_train::run::CHECKPOINT), b"broken").unwrap();
    export(&run, "glb", &["--out", path(&file)]).refused(3, &["checkpoint.safetensors"]);
    assert_eq!(std::fs::read(&file).unwrap(), before);
}
