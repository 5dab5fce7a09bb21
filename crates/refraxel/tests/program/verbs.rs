//! The verbs in the order in which people use them, on tiny datasets.

use super::runs::{bent, copy_of, data, straight};
use crate::common::running::*;
use crate::common::*;
use refraxel_data::photographs::stored_pixels;
use refraxel_train::checkpoint::{TensorData, TensorFile};
use refraxel_train::run::CHECKPOINT;
use serde_json::Value;
use std::path::Path;
use std::process::Stdio;

#[test]
fn train_eval_compare_render_and_inspect_work_together() {
    let (folder, data, run) = ball_and("run");
    let trained = train(&data, &run, &["--json", "--refraction", "off"]).done().json();
    for file in [
        CHECKPOINT,
        "log.jsonl",
        "curves.png",
        "eval/test/metrics.json",
        "eval/test/r_0.png",
        "eval/test.png",
    ] {
        assert!(run.join(file).is_file(), "{file}");
    }
    assert_eq!((&trained["ior"]["mean_inside"], &trained["images"]), (&1.0.into(), &2.into()));
    assert!((trained["ior"]["mae_inside"].as_f64().unwrap() - 0.5).abs() < 1e-9);
    let evaluated = refraxel(&["eval", path(&run), "--json"]).done().json();
    assert_eq!(evaluated, trained);
    refraxel(&["eval", path(&run), "--split", "train", "--quiet"]).done();
    assert!(run.join("eval/train/r_4.png").is_file());

    let out = folder.path().join("comparison");
    let compared = refraxel(&["compare", path(&run), path(&run), "--truth", "--out", path(&out)]).done();
    assert!(
        compared.out.starts_with("run") && compared.out.contains("index error inside"),
        "{}",
        compared.out
    );
    assert!(out.join("comparison.png").is_file());
    let wipe = folder.path().join("wipe.gif");
    let words = ["compare", path(&run), path(&run), "--wipe", path(&wipe)];
    refraxel(&[&words[..], &["--view", "r_1.png"]].concat()).done();
    assert!(std::fs::read(&wipe).unwrap().starts_with(b"GIF89a"));
    refraxel(&[&words[..], &["--view", "x.png"]].concat()).refused(3, &["--view x.png", "r_0.png"]);
    refraxel(&["compare", path(&run), "--wipe", path(&wipe)]).refused(2, &["two runs", "found 1"]);
    let table = refraxel(&["compare", path(&run), "--json"]).done().json();
    assert_eq!(table["runs"][0]["psnr"], trained["psnr"]);

    let views = folder.path().join("views");
    let words =
        ["render", path(&run), "--orbit", "3", "--out", path(&views), "--outputs", "colour,depth,opacity"];
    refraxel(&words).done();
    for file in
        ["0002.png", "depth/0002.png", "depth_preview/0002.png", "opacity/0002.png", "transforms.json"]
    {
        assert!(views.join(file).is_file(), "{file}");
    }
    assert_eq!(stored_pixels(views.join("depth/0000.png")).unwrap().color(), image::ColorType::L16);

    let inspected = refraxel(&["inspect", path(&run), "--json"]).done().json();
    assert_eq!((&inspected["kind"], &inspected["step"]), (&"run".into(), &40.into()));
    assert_eq!(inspected["evaluation"]["psnr"], trained["psnr"]);
    assert!(refraxel(&["inspect", path(&run)]).done().out.contains("steps=40"));
}

#[test]
fn rendering_the_cameras_of_the_test_split_gives_the_pictures_of_eval() {
    let folder = tempfile::tempdir().unwrap();
    let (cameras, views) = (data().join("transforms_test.json"), folder.path().join("views"));
    refraxel(&["render", path(bent()), "--cameras", path(&cameras), "--out", path(&views)]).done();
    let pixels = |p: &Path| stored_pixels(p).unwrap().into_rgb8();
    assert_eq!(pixels(&views.join("r_1.png")), pixels(&bent().join("eval/test/r_1.png")));
}

#[test]
fn inspect_forecasts_a_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    let json = refraxel(&["inspect", path(&data), "--json"]).done().json();
    assert_eq!((&json["kind"], &json["views"]["train"]), (&"dataset".into(), &5.into()));
    assert!(json["forecast"]["peak"].as_u64() > json["forecast"]["model"].as_u64());
    // Five masks of 16×16: two maps of contours and occluders, and cells of a pixel, in f32.
    assert_eq!(json["forecast"]["silhouettes"], 5 * 16 * 16 * 12);
    let options = ["--refraction", "off", "--set", "grid.resolution=48", "--set", "run.batch=1000000"];
    let other = refraxel(&[&["inspect", path(&data), "--json"], &options[..]].concat()).done().json();
    let resolution = other["forecast"]["resolution"].as_array().unwrap();
    assert_eq!(resolution.iter().map(|n| n.as_u64()).max(), Some(Some(48)));
    assert_eq!(other["forecast"]["silhouettes"], 0);
    assert!(other["forecast"]["peak"].as_u64().unwrap() > 1_000_000_000, "a million rays");
    refraxel(&["inspect", path(&data), "--set", "grid.resolution=2"]).refused(2, &["grid.resolution"]);
    let text = refraxel(&["inspect", path(&data)]).done().out;
    for word in ["5 training, 1 validation, 2 test", "8 of 16×16", "refractive object is seen first", "grid "]
    {
        assert!(text.contains(word), "{word}: {text}");
    }
}

#[test]
fn synth_writes_a_dataset_once() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("lens");
    let words = ["synth", "luneburg", "--out", path(&out), "--size", "8", "--views", "3", "--spp", "1"];
    let words = [&words[..], &["--detail-spp", "0", "--index-resolution", "4", "--quiet", "--json"]].concat();
    let first = refraxel(&words).done().json();
    assert_eq!(first["views"], serde_json::json!([3, 1, 2]));
    assert!(out.join("transforms_train.json").is_file());
    let second = refraxel(&words).done().json();
    assert_eq!((&second["rendered"], &second["kept"]), (&0.into(), &first["rendered"]));
    let list = refraxel(&["synth", "--list", "--json"]).done().json();
    assert!(list.as_array().unwrap().len() >= 12);
}

/// Tensors and state of a run, without the clock.
fn content(run: &Path) -> (TensorFile, Value) {
    let mut file = TensorFile::load(&run.join(CHECKPOINT)).unwrap();
    file.header["state"]["seconds"] = 0.into();
    let header = std::mem::take(&mut file.header);
    (file, header)
}

#[test]
fn resumed_runs_have_the_bits_of_uninterrupted_ones() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    let [whole, run] = ["whole", "stopped"].map(|name| folder.path().join(name));
    train(&data, &whole, &[]).done();
    // Within the first stage, within the last, and after the occupied cells were looked at again.
    for (stop, how) in [(3, "--overwrite"), (20, "--resume"), (37, "--resume")] {
        let stopped = train(&data, &run, &[how, "--set", &format!("stop_after={stop}")]);
        stopped.refused(130, &[&format!("stopped at step {stop} and saved"), "--resume"]);
    }
    train(&data, &run, &["--resume"]).done();
    assert!(content(&run) == content(&whole));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    let on = |threads: &str| {
        let run = folder.path().join(threads);
        train(&data, &run, &["--threads", threads]).done();
        content(&run)
    };
    assert!(on("1") == on("3"));
}

#[test]
fn masks_make_rays_bend_and_the_run_keeps_what_bends_them() {
    let folder = tempfile::tempdir().unwrap();
    let data = refractive(folder.path(), "glass_ball", 30, 48);
    let run = folder.path().join("run");
    let options = [
        "--set",
        "steps=400",
        "--set",
        "grid.resolution=40",
        "--set",
        "batch=1024",
        "--set",
        "straight_steps=100",
        "--set",
        "judge.enabled=off",
        "--set",
        "shape.faces=off", // 48 pixels tell little of a shape
    ];
    let trained = train(&data, &run, &[&options[..], &["--json"]].concat()).done().json();
    let index = trained["ior"]["mean_inside"].as_f64().unwrap();
    assert!((1.3..1.7).contains(&index), "{index}");
    let straight = folder.path().join("straight");
    let off =
        train(&data, &straight, &[&options[..], &["--refraction", "off", "--json"]].concat()).done().json();
    let inside = |run: &Value| run["psnr_inside"].as_f64().unwrap();
    assert!(inside(&trained) > inside(&off) + 1.0, "{} {}", inside(&trained), inside(&off));
    let log = std::fs::read_to_string(run.join("log.jsonl")).unwrap();
    assert!(
        log.contains("\"event\":\"region_found\",\"region\":0") && log.contains("\"phase\":\"joint\""),
        "{log}"
    );
    assert_eq!(refraxel(&["eval", path(&run), "--json"]).done().json(), trained);
}

#[test]
fn pictures_of_reflection_and_transmission_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let (data, run, out) = (glass(folder.path()), folder.path().join("run"), folder.path().join("views"));
    let scene = data.join("scene.json");
    let known = ["--refraction", "on", "--index-from", path(&scene), "--reflection", "on"];
    train(&data, &run, &[&known[..], &["--set", "steps=80", "--set", "straight_steps=20"]].concat()).done();
    let layers = "colour,reflection,transmission,normal";
    refraxel(&["render", path(&run), "--orbit", "1", "--out", path(&out), "--outputs", layers]).done();
    let picture = |name: &str| stored_pixels(out.join(name)).unwrap().into_rgb8();
    let (colour, transmitted) = (picture("0000.png"), picture("transmission/0000.png"));
    let mirrored = picture("reflection/0000.png");
    let changed = colour.pixels().zip(transmitted.pixels()).zip(mirrored.pixels());
    assert!(changed.clone().any(|((c, t), m)| c != t && m.0 != [0; 3]));
    assert!(
        changed.clone().any(|((c, t), m)| c == t && m.0 == [0; 3]),
        "beside the glass nothing is mirrored"
    );
    let inspected = refraxel(&["inspect", path(&run), "--json"]).done().json();
    let strength = inspected["reflection_strengths"][0].as_f64().unwrap();
    assert!(strength > 0.0 && strength <= 1.0, "{strength}");
}

#[test]
fn a_box_or_a_file_says_what_is_refractive_where_no_mask_does() {
    let (_folder, data, run) = ball_and("run");
    let inside = |more: &[&str]| {
        let run = train(&data, &run, &[more, &["--json", "--overwrite"]].concat()).done().json();
        run["ior"]["mean_inside"].as_f64().unwrap()
    };
    let fixed = [
        "--set",
        "index.rate=0",
        "--set",
        "surface.rate=0",
        "--set",
        "shape.start=ball",
        "--set",
        "judge.enabled=off",
    ];
    let of_box = ["--refraction-box", "-0.5,-0.5,-0.7,0.5,0.5,0.3", "--set", "search.enabled=off"];
    let boxed = inside(&[&fixed[..], &of_box, &["--set", "search.guess=1.25"]].concat());
    assert!((1.1..=1.25).contains(&boxed), "{boxed}");
    let scene = data.join("scene.json");
    let truth = ["--index-from", path(&scene), "--set", "search.profile=sharp"];
    let truth = inside(&[&truth[..], &fixed[..4]].concat());
    assert!((truth - 1.5).abs() < 0.02, "{truth}");
}

#[test]
fn a_resumed_clearcoat_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    let coated = ["--refraction", "off", "--clearcoat", "on"];
    let [whole, halted] = ["whole", "halted"].map(|name| folder.path().join(name));
    train(&data, &whole, &coated).done();
    train(&data, &halted, &[&coated[..], &["--set", "stop_after=20"]].concat()).refused(130, &[]);
    assert_eq!(content(&halted).1["clearcoat"]["degree"], 3);
    train(&data, &halted, &["--resume"]).done();
    assert!(content(&halted) == content(&whole));
    train(&data, &halted, &["--resume", "--clearcoat", "off"]).refused(3, &["`clearcoat.enabled` is off"]);
}

#[test]
fn values_and_moments_that_are_not_numbers_are_refused() {
    let (run, checkpoint) = copy_of(bent());
    let sound = std::fs::read(&checkpoint).unwrap();
    for (name, wrong, said) in [
        ("index.0.surface_first_moment", f32::NAN, "refractive region 0 has moments that are not finite"),
        ("density", f32::INFINITY, "`density` has values that are not finite"),
        ("background", f32::NAN, "`background` has values that are not finite"),
        ("density_moment", f32::NAN, "`density_moment` has values that are no squares"),
        ("colour_moment", -1.0, "`colour_moment` has values that are no squares"),
        ("background_moment", f32::NAN, "`background_moment` has values that are no squares"),
    ] {
        std::fs::write(&checkpoint, &sound).unwrap();
        let mut file = TensorFile::load(&checkpoint).unwrap();
        let Some(tensor) = file.tensors.get_mut(name) else { panic!("{name}") };
        let TensorData::F32(values) = &mut tensor.data else { panic!("{name}: single precision") };
        let Some(last) = values.to_mut().last_mut() else { continue }; // a background of one colour has no texels
        *last = wrong;
        file.save(&checkpoint).unwrap();
        refraxel(&["eval", path(run.path())]).refused(3, &[said]);
    }
}

#[test]
fn a_stored_run_whose_options_are_gone_is_read_if_they_had_the_value_that_is_a_constant_now() {
    let (run, checkpoint) = copy_of(straight());
    let mut file = TensorFile::load(&checkpoint).unwrap();
    let mut with = |decay: f64| {
        file.header["options"]["field"]["rate_decay"] = decay.into();
        file.save(&checkpoint).unwrap();
        refraxel(&["inspect", path(run.path())])
    };
    with(0.05).done();
    with(0.1).refused(3, &["option `field.rate_decay` is gone", "RATE_DECAY"]);
}

#[test]
fn resume_refuses_other_options_and_other_images() {
    let (_folder, data, run) = ball_and("run");
    train(&data, &run, &["--set", "stop_after=5"]).refused(130, &[]);
    train(&data, &run, &["--resume", "--set", "batch=64"])
        .refused(3, &["`run.batch` is 64", "trained with 256"]);
    train(&data, &run, &["--resume", "--seed", "3"]).refused(3, &["`run.seed` is 3"]);
    let other = photographs(4, |_| {});
    train(other.path(), &run, &["--resume"]).refused(3, &["trained on other images"]);
}

#[cfg(unix)]
#[test]
fn an_interrupt_saves_and_resume_goes_on() {
    let (_folder, data, run) = ball_and("run");
    let words =
        ["train", path(&data), "--out", path(&run), "--quiet", "--set", "steps=1000000", "--set", "batch=64"];
    let words = [&words[..], &["--set", "grid.resolution=16"]].concat();
    let child = Running::start(command(&words).stderr(Stdio::piped()));
    wait_until("no record was written", || {
        std::fs::metadata(run.join("log.jsonl")).is_ok_and(|m| m.len() > 0)
    });
    send(&child, &["INT"]);
    child.ended().refused(130, &["stopped at step", "--resume"]);
    let saved = step(&run);
    assert!(saved >= 25);
    let stop = format!("stop_after={}", saved + 7);
    refraxel(&[&words[..], &["--resume", "--set", &stop]].concat()).refused(130, &[]);
    assert_eq!(step(&run), saved + 7);
    assert!(!has_leftovers(&run));
}

#[test]
fn photographs_are_read_with_fewer_pixels_in_training_evaluation_and_resumption() {
    let (folder, data, run) = ball_and("run");
    let half = ["--downscale", "2", "--refraction", "off", "--set", "run.stop_after=20"];
    let borders = ["--crop", "0,2,0,4", "--up", "0,-0.1,2"];
    let stopped = train(&data, &run, &[&half[..], &borders].concat());
    assert_eq!(stopped.code, 130, "{}", stopped.err);
    let length = ["--refraction", "off", "--resume", "--set", "run.stop_after=0"];
    let other = [&length[..], &["--downscale", "8"]].concat();
    train(&data, &run, &other).refused(3, &["with --downscale 2", "leave --downscale out"]);
    let other = [&length[..], &["--crop", "1,2,0,4"]].concat();
    train(&data, &run, &other).refused(3, &["with --crop 0,2,0,4", "leave --crop out"]);
    let other = [&length[..], &["--up", "0,0,2"]].concat();
    train(&data, &run, &other).refused(3, &["with --up 0,-0.1,2", "leave --up out"]);
    train(&data, &run, &length).done();
    let picture = stored_pixels(run.join("eval/test/r_0.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (8, 5));
    refraxel(&["eval", path(&run), "--quiet"]).done();
    let new = folder.path().join("other");
    train(&data, &new, &["--crop", "9,0,0,0"]).refused(3, &["9,0,0,0", "r_0.png", "16x16", "at least 8"]);
    train(&data, &new, &["--crop", "9,0"]).refused(2, &["L,T,R,B"]);
    train(&data, &new, &["--up", "0,0,0"]).refused(2, &["three numbers"]);
    refraxel(&["mask", path(&data), "--crop", "1,1,1,1"]).refused(2, &["whole photographs"]);
    train(&data, &folder.path().join("other"), &["--downscale", "40"]).refused(2, &["1 to 32", "64 or more"]);
}

#[test]
fn a_look_that_finds_nothing_says_how_near_it_came() {
    let data = photographs(12, |_| {});
    let run = data.path().join("run");
    let seeking = ["--set", "detection.rays=1000", "--set", "detection.separation=1"]; // which nothing has
    train(data.path(), &run, &seeking).done();
    let log = std::fs::read_to_string(run.join("log.jsonl")).unwrap();
    let events = log.lines().flat_map(|line| {
        let record: Value = serde_json::from_str(line).unwrap();
        record["events"].as_array().cloned().unwrap_or_default()
    });
    let looks: Vec<Value> = events.filter(|event| event["event"] == "nothing_detected").collect();
    assert_eq!(looks.len(), 1, "{log}");
    let separation = looks[0]["separation"].as_f64().unwrap();
    assert!((0.0..1.0).contains(&separation) && looks[0]["needed"] == 1.0, "{}", looks[0]);
    let shown = refraxel(&["inspect", path(&run), "--json"]).done().json();
    assert_eq!(shown["evaluation"]["run"]["rays"], "straight", "{shown}");
}
