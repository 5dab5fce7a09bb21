//! Bad input ends in one clear message, the documented exit code, and without files under their final names.

use crate::common::*;
use refraxel_train::run::CHECKPOINT;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Both `inspect` and `train` refuse the dataset, and nothing is written.
fn refused_dataset(data: &Path, words: &[&str]) {
    refraxel(&["inspect", path(data)]).refused(3, words);
    refused_training(data, words);
}

fn refused_training(data: &Path, words: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("run");
    train(data, &out, &[]).refused(3, words);
    assert!(is_without_files(&out));
}

fn refused_photographs(count: usize, edit: impl FnOnce(&mut Value), words: &[&str]) {
    refused_dataset(photographs(count, edit).path(), words);
}

/// Photographs of which half is replaced by `bytes`.
fn with_images(bytes: &[u8]) -> TempDir {
    let folder = photographs(4, |_| {});
    for name in ["r_2.png", "r_3.png"] {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

#[test]
fn missing_and_unknown_folders() {
    refused_dataset(Path::new("/no/such/place"), &["/no/such/place", "no such file or folder"]);
    let empty = tempfile::tempdir().unwrap();
    refused_dataset(empty.path(), &["no dataset found", "transforms.json"]);
}

#[test]
fn damaged_images() {
    let whole = std::fs::read(photographs(4, |_| {}).path().join("r_2.png")).unwrap();
    let refused = |bytes: &[u8], word| refused_dataset(with_images(bytes).path(), &["r_2.png", word]);
    refused(&whole[..whole.len() - 30], "cut off");
    refused(b"", "0 bytes");
    refused(b"not an image", "cannot decode");
}

#[test]
fn jpegs_that_lack_a_part_of_their_picture() {
    let jpeg = |i: usize| format!("r_{i}.jpg");
    let folder = photographs(9, |t| {
        let frames = t["frames"].as_array_mut().unwrap();
        frames.iter_mut().enumerate().for_each(|(i, f)| f["file_path"] = json!(jpeg(i)));
    });
    for i in 0..9 {
        write_image(&folder.path().join(jpeg(i)), 16, 16);
    }
    let write = |i: usize, edit: &dyn Fn(&mut Vec<u8>)| {
        let file = folder.path().join(jpeg(i));
        let whole = std::fs::read(&file).unwrap();
        let mut damaged = whole.clone();
        edit(&mut damaged);
        std::fs::write(&file, damaged).unwrap();
        whole
    };
    // The first is held out: it would be decoded after training.
    for i in [4, 0] {
        // One that ends as a whole one does is noticed when its codes are counted.
        let whole = write(i, &|bytes| drop(bytes.drain(bytes.len() - 40..bytes.len() - 2)));
        refused_training(folder.path(), &[&jpeg(i), "breaks off after", "export the image again"]);
        std::fs::write(folder.path().join(jpeg(i)), whole).unwrap();
    }
    (0..5).for_each(|i| drop(write(i, &|bytes| bytes.truncate(bytes.len() - 40))));
    refused_dataset(folder.path(), &["5 of 9 views cannot be used", "cut off", &jpeg(0), "breaks off after"]);
}

#[test]
fn absurd_image_sizes() {
    let folder = photographs(4, |_| {});
    let file = folder.path().join("r_2.png");
    let mut bytes = std::fs::read(&file).unwrap();
    bytes[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]); // 65536 × 65536 in the header
    let crc = crc32fast::hash(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    std::fs::write(file, bytes).unwrap();
    refused_dataset(folder.path(), &["r_2.png"]);
}

#[test]
fn impossible_cameras() {
    let pose = |row: usize, column: usize, value: Value| {
        move |t: &mut Value| t["frames"][1]["transform_matrix"][row][column] = value
    };
    refused_photographs(4, pose(0, 3, "NaN".into()), &["transforms.json", "frames[1]", "transform_matrix"]);
    refused_photographs(4, pose(0, 0, 1e300.into()), &["frames[1]"]);
    refused_photographs(4, |t| t["fl_x"] = json!(0.0), &["fl_x", "focal length > 0"]);
    refused_photographs(4, |t| t["w"] = json!(0), &["w is 0"]);
}

#[test]
fn a_pose_that_is_not_a_number() {
    let folder = photographs(4, |_| {});
    let file = folder.path().join("transforms.json");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replacen("[[", "[[NaN,", 1)).unwrap();
    refused_dataset(folder.path(), &["transforms.json"]);
    std::fs::write(&file, text.replacen("[[", "[[1e999,", 1)).unwrap();
    refused_dataset(folder.path(), &["transforms.json"]);
}

#[test]
fn cameras_that_show_nothing() {
    let set = |key: &'static str, value: f64| move |t: &mut Value| t[key] = json!(value);
    refused_photographs(
        4,
        |t| (t["fl_x"], t["fl_y"]) = (json!(1e-9), json!(1e-9)),
        &["frames[0]", "focal lengths are [1e-9"],
    );
    refused_photographs(
        4,
        |t| (t["fl_x"], t["fl_y"]) = (json!(1e12), json!(1e12)),
        &["focal lengths", "1000 times"],
    );
    refused_photographs(
        4,
        |t| (t["cx"], t["cy"]) = (json!(1e9), json!(8)),
        &["principal point is [1000000000.0"],
    );
    refused_photographs(4, set("k1", -1e4), &["frames[0]", "the lens shows something on"]);
}

/// All cameras of a dataset, changed.
fn move_cameras(t: &mut Value, edit: impl Fn(usize, f64) -> f64) {
    for frame in t["frames"].as_array_mut().unwrap() {
        for row in 0..3 {
            let entry = &mut frame["transform_matrix"][row][3];
            *entry = json!(edit(row, entry.as_f64().unwrap()));
        }
    }
}

#[test]
fn cameras_out_of_reach_are_refused_but_not_those_that_are_far_away_together() {
    let one_far = |t: &mut Value| t["frames"][1]["transform_matrix"][0][3] = json!(1e300);
    refused_photographs(4, one_far, &["frames[1]", "stands 1.0e300 scene units from the origin"]);
    let all_far = photographs(4, |t| move_cameras(t, |row, x| if row == 0 { x + 1e8 } else { x }));
    train(all_far.path(), &all_far.path().join("run"), &[]).done();
    let tiny = photographs(4, |t| move_cameras(t, |_, x| x * 1e-20));
    refused_training(tiny.path(), &["the scene's box reaches from", "another unit of length"]);
}

#[test]
fn a_panorama_from_a_tripod_trains_with_straight_rays() {
    let data = photographs(9, |t| move_cameras(t, |row, _| row as f64));
    std::fs::create_dir(data.path().join("glass_masks")).unwrap();
    for i in 0..9 {
        let mask = image::GrayImage::from_fn(16, 16, |x, y| image::Luma([if x + y < 12 { 255 } else { 0 }]));
        mask.save(data.path().join(format!("glass_masks/r_{i}.png"))).unwrap();
    }
    let out = data.path().join("run");
    train(data.path(), &out, &["--poses", "learn"]).done();
    let log = std::fs::read_to_string(out.join("log.jsonl")).unwrap();
    assert!(log.contains(r#""why":"one_place""#), "{log}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_path_that_no_checkpoint_can_name() {
    use std::os::unix::ffi::OsStrExt;
    let folder = photographs(4, |_| {});
    let strange = folder.path().join(std::ffi::OsStr::from_bytes(b"da\xffta"));
    std::os::unix::fs::symlink(folder.path(), &strange).unwrap();
    let out = folder.path().join("run");
    let mut line = command(&["train", "--quiet", "--out", path(&out)]);
    Ran::of(line.arg(&strange).output().unwrap()).refused(3, &["no text in UTF-8", "rename it"]);
    assert!(!out.exists());
}

#[test]
fn splits_without_training_or_test_images() {
    let lists = |edit: &dyn Fn(&Path)| {
        let folder = photographs(4, |_| {});
        edit(folder.path());
        folder
    };
    let unknown = lists(&|p| std::fs::write(p.join("train_list.txt"), "nobody.png").unwrap());
    refused_dataset(unknown.path(), &["none of the 4 views trains", "train_list.txt"]);
    let none = photographs(4, |t| t["train_filenames"] = json!([]));
    refused_dataset(none.path(), &["none of the 4 views trains"]);
    let all =
        lists(&|p| std::fs::write(p.join("train_list.txt"), "r_0.png\nr_1.png\nr_2.png\nr_3.png").unwrap());
    let out = all.path().join("run");
    let ran = train(all.path(), &out, &["--json"]).done();
    assert!(ran.json().is_null() && out.join(CHECKPOINT).exists() && !out.join("eval").exists());
    let loud = [
        "train",
        path(all.path()),
        "--out",
        path(&out),
        "--overwrite",
        "--set",
        "steps=1",
        "--set",
        "batch=64",
    ];
    let ran = refraxel(&loud).done();
    assert!(
        ran.err.contains("note: no images are held out") && ran.out.contains("the run is not scored"),
        "{}",
        ran.err
    );
}

#[test]
fn known_indices_that_no_ray_can_follow() {
    let (folder, data, out) = ball_and("run");
    let refused = |name: &str, content: &str, words: &[&str]| {
        std::fs::write(folder.path().join(name), content).unwrap();
        train(&data, &out, &["--index-from", path(&folder.path().join(name))]).refused(3, words);
        assert!(!out.exists(), "{name}");
    };
    let sphere = |radius: &str, x: &str, ior: &str| {
        format!(
            r#"{{"refractive": [{{"shape": "sphere", "center": [{x}, 0, 0], "radius": {radius}, "ior": {ior}}}]}}"#
        )
    };
    refused("r0.json", &sphere("0", "0", "1.5"), &["r0.json", "refractive[0].radius is 0"]);
    refused("nan.json", &sphere("NaN", "0", "1.5"), &["refractive[0].radius is null (or NaN)"]);
    refused(
        "tiny.json",
        &sphere("1e-30", "0", "1.5"),
        &["tiny.json", "out of scale with the scene's box from [", "unit of length"],
    );
    refused("huge.json", &sphere("1e30", "0", "1.5"), &["huge.json", "out of scale"]);
    refused("far.json", &sphere("0.5", "1e6", "1.5"), &["out of scale"]);
    refused("r300.json", &sphere("1e300", "0", "1.5"), &["out of scale"]);
    refused("n1.json", &sphere("0.5", "0", "1"), &["refractive is of index 1 in all bodies"]);
    refused("n30.json", &sphere("0.5", "0", "1e30"), &["refractive[0].ior", "from 0.25 to 5"]);
    let mesh =
        |top: &str| format!("v {top}\nv -1 -1 0\nv 1 -1 0\nv 0 1 0\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    refused("m.obj", &mesh("1e300 0 1"), &["out of scale"]);
    refused("flat.obj", &mesh("0 0 0"), &["flat.obj", "a body with edges > 0"]);
    refused("empty.obj", "", &["empty.obj", "it has 0 vertices"]);
    let usual = data.join("scene.json");
    let unused = |flags: &[&str], words: &[&str]| {
        train(&data, &out, &[&["--index-from", path(&usual)], flags].concat()).refused(2, words);
    };
    unused(&["--refraction", "off"], &["the known index would not be used", "`refraction.bend`"]);
    unused(&["--set", "shape.start=hull"], &["the known index would not be used", "`shape.start`"]);
    train(&data, &out, &["--refraction-box", "0,0,0,1e30,1e30,1e30"])
        .refused(3, &["refraction.bounds", "out of scale"]);
}

#[test]
fn too_few_views() {
    for count in 0..3 {
        refused_photographs(count, |_| {}, &[&format!("{count} usable views; at least 3")]);
    }
}

#[test]
fn masks_that_leave_nothing() {
    let folder = photographs(4, |_| {});
    std::fs::create_dir(folder.path().join("masks")).unwrap();
    for i in 0..4 {
        let black = image::GrayImage::new(16, 16);
        black.save(folder.path().join(format!("masks/r_{i}.png"))).unwrap();
    }
    let out = folder.path().join("run");
    train(folder.path(), &out, &[]).refused(3, &["no training pixel", "--mask-meaning"]);
    assert!(!out.join(CHECKPOINT).exists());
}

#[test]
fn descriptions_that_would_take_all_memory() {
    let folder = tempfile::tempdir().unwrap();
    let frames = "{\"a\":{}},".repeat(400_000);
    std::fs::write(folder.path().join("transforms.json"), format!("{{\"frames\":[{frames}{{}}]}}")).unwrap();
    refused_dataset(folder.path(), &["transforms.json", "the number of objects", "the limit is"]);
}

#[test]
fn wrong_options() {
    let data = photographs(4, |_| {});
    let out = data.path().join("run");
    let toml = data.path().join("options.toml");
    train(data.path(), &out, &["--set", "stepz=3"]).refused(2, &["unknown option `stepz`", "`run.steps`"]);
    train(data.path(), &out, &["--set", "steps=-3"]).refused(2, &["`run.steps` is `-3`"]);
    train(data.path(), &out, &["--refraction", "on"]).refused(3, &["no masks", "--refraction-box"]);
    train(data.path(), &out, &["--refraction-box", "0,0,0,1,1"]).refused(2, &["x0,y0,z0,x1,y1,z1"]);
    train(data.path(), &out, &["--index-from", "no/scene.json"]).refused(3, &["no/scene.json"]);
    train(data.path(), &out, &["--index-from", path(&data.path().join("r_0.png"))])
        .refused(3, &["scene.json", "mesh"]);
    train(data.path(), &out, &["--set", "search.profile=soft"])
        .refused(2, &["`search.profile` is `soft`", "`sharp`"]);
    train(data.path(), &out, &["--set", "rate=1"]).refused(2, &["`surface.rate`", "`index.rate`"]);
    train(data.path(), &out, &["--set", "judge.margin=2"]).refused(2, &["is gone", "MARGIN"]);
    let with = |content: &str| {
        std::fs::write(&toml, content).unwrap();
        train(data.path(), &out, &["--config", path(&toml)])
    };
    with("steps = = 3").refused(3, &["options.toml", "not a TOML file"]);
    with("stepz = 3").refused(3, &["options.toml", "unknown option `stepz`"]);
    with("[training]\nsteps = 3").refused(3, &["options.toml", "unknown option `training.steps`"]);
    with("[surface]\nblurr = 3").refused(3, &["options.toml", "did you mean `surface.blur`"]);
    with("surface.blur = 30").refused(3, &["`surface.blur` is `30`", "0 to 8 voxels"]);
    train(data.path(), &out, &["--config", "/no/such.toml"]).refused(3, &["/no/such.toml"]);
    train(data.path(), &out, &["--config", "/dev/zero"]).refused(3, &["/dev/zero", "not a regular file"]);
    assert!(!out.exists());
}

#[test]
#[cfg(unix)]
fn files_of_a_run_that_have_no_end() {
    let folder = tempfile::tempdir().unwrap();
    let run = short_run(folder.path());
    let endless = |name: &str| {
        let file = run.join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        let _ = std::fs::remove_file(&file); // some are there
        std::os::unix::fs::symlink("/dev/zero", file).unwrap();
    };
    endless("eval/test/metrics.json");
    refraxel(&["compare", path(&run)]).refused(4, &["metrics.json", "not a regular file"]);
    endless("o/render_files.txt");
    refraxel(&["render", path(&run), "--orbit", "1", "--out", path(&run.join("o"))])
        .refused(4, &["render_files.txt", "not a regular file"]);
    endless("log.jsonl"); // a run is worth more than its log
    train(&folder.path().join("ball"), &run, &["--resume", "--set", "stop_after=2"])
        .refused(130, &["step 2"]);
}

#[test]
fn folders_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    let nowhere = Path::new("/dev/null/x"); // below a file, so that root is refused too
    train(&data, nowhere, &[]).refused(4, &["/dev/null/x"]);
    refraxel(&["synth", "opaque", "--out", "/dev/null/x"]).refused(4, &["/dev/null/x"]);
    let run = folder.path().join("run");
    train(&data, &run, &["--set", "stop_after=1"]).refused(130, &[]);
    refraxel(&["render", path(&run), "--orbit", "1", "--out", "/dev/null/x"]).refused(4, &["/dev/null/x"]);
    std::fs::write(run.join("eval"), "in the way").unwrap();
    refraxel(&["eval", path(&run)]).refused(4, &["eval"]);
}

/// A run that was trained for one step, beside its dataset.
fn short_run(folder: &Path) -> PathBuf {
    let (data, run) = (ball(folder), folder.join("run"));
    train(&data, &run, &["--set", "stop_after=1"]).refused(130, &[]);
    run
}

#[test]
fn damaged_and_foreign_checkpoints() {
    let folder = tempfile::tempdir().unwrap();
    let run = short_run(folder.path());
    let file = run.join(CHECKPOINT);
    let whole = std::fs::read(&file).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    let cases: [(&[u8], &str); 4] = [
        (&flipped, "damaged"),
        (&whole[..whole.len() - 9], "damaged"),
        (b"", "not a refraxel checkpoint"),
        (
            b"some other file that happens to have this name, longer than any prefix",
            "not a refraxel checkpoint",
        ),
    ];
    let (data, views) = (folder.path().join("ball"), folder.path().join("views"));
    for (bytes, word) in cases {
        std::fs::write(&file, bytes).unwrap();
        refraxel(&["inspect", path(&run)]).refused(3, &[word, CHECKPOINT]);
        refraxel(&["eval", path(&run)]).refused(3, &[word]);
        refraxel(&["render", path(&run), "--orbit", "1", "--out", path(&views)]).refused(3, &[word]);
        train(&data, &run, &["--resume"]).refused(3, &[word]);
        assert_eq!(std::fs::read(&file).unwrap(), bytes, "the file is left as it was");
    }
    assert!(!views.exists());
}

#[test]
fn runs_that_are_not_there_or_not_ready() {
    let folder = tempfile::tempdir().unwrap();
    let run = short_run(folder.path());
    refraxel(&["compare", path(&run)]).refused(3, &["has not been evaluated", "refraxel eval"]);
    refraxel(&["compare", "/no/run"]).refused(3, &["/no/run is not the folder of a run"]);
    refraxel(&["eval", "/no/run"]).refused(3, &["/no/run", "name the folder", "--out"]);
    refraxel(&["render", "/no/run", "--orbit", "1", "--out", "x"]).refused(3, &["/no/run"]);
    train(&folder.path().join("ball"), Path::new("/no/run"), &["--resume"]).refused(3, &["/no/run"]);
    std::fs::rename(folder.path().join("ball"), folder.path().join("moved")).unwrap();
    refraxel(&["eval", path(&run)]).refused(3, &["ball", "no such file or folder"]);
}

#[test]
fn comparing_runs_of_different_images() {
    let folder = tempfile::tempdir().unwrap();
    let other = photographs(9, |_| {});
    let (a, b) = (folder.path().join("a"), folder.path().join("b"));
    train(&ball(folder.path()), &a, &["--set", "steps=1"]).done();
    train(other.path(), &b, &["--set", "steps=1"]).done();
    refraxel(&["compare", path(&a), path(&b)]).refused(3, &["they are not the same"]);
    std::fs::remove_file(a.join("eval/test/r_0.png")).unwrap();
    let out = folder.path().join("out");
    refraxel(&["compare", path(&a), "--out", path(&out)]).refused(3, &["r_0.png", "again"]);
    assert!(!out.exists());
}

#[test]
fn cameras_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let run = short_run(folder.path());
    let (file, views) = (folder.path().join("path.json"), folder.path().join("views"));
    let render =
        |cameras: &Path| refraxel(&["render", path(&run), "--cameras", path(cameras), "--out", path(&views)]);
    render(&file).refused(3, &["path.json", "no such file"]);
    for (text, word) in [("{", "not valid JSON"), ("{}", "frames"), (r#"{"frames": []}"#, "no cameras")] {
        std::fs::write(&file, text).unwrap();
        render(&file).refused(3, &["path.json", word]);
    }
    assert!(!views.exists());
}

#[test]
fn scenes_that_cannot_be_made() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let synth = |words: &[&str]| refraxel(&[&["synth"], words, &["--out", path(&out)]].concat());
    synth(&["glas_ball"]).refused(2, &["\"glas_ball\"", "glass_ball"]);
    synth(&["glass_ball", "--ior", "0.5"]).refused(2, &["--ior", "from 1 to 4"]);
    synth(&["luneburg", "--ior", "1.5"]).refused(2, &["no index to choose"]);
    synth(&["glass_ball", "--size", "0"]).refused(2, &["--size"]);
    synth(&["glass_ball", "--mesh", "knot.obj"]).refused(2, &["glass_mesh"]);
    synth(&["glass_mesh", "--mesh", "/no/knot.obj"]).refused(3, &["/no/knot.obj"]);
    assert!(!out.exists());
    let theirs = photographs(3, |_| {});
    std::fs::rename(theirs.path().join("transforms.json"), theirs.path().join("transforms_train.json"))
        .unwrap();
    let words = ["synth", "glass_ball", "--out", path(theirs.path())];
    refraxel(&words).refused(3, &["did not make", "transforms_train.json"]);
}

#[test]
fn training_says_what_is_doubtful_even_where_it_is_quiet_and_what_was_decided_where_it_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    std::fs::remove_file(data.join("train/r_2.png")).unwrap();
    let quiet = train(&data, &folder.path().join("quiet"), &["--refraction", "off"]).done();
    assert!(quiet.err.starts_with("warning: 1 of 8 views are left out"), "{}", quiet.err);
    assert!(!quiet.err.contains("note:"), "{}", quiet.err);
    let out = folder.path().join("told");
    let mut words = vec!["train", path(&data), "--out", path(&out), "--refraction", "off"];
    words.extend(TINY);
    let told = refraxel(&words).done();
    let before = told.err.split("training started").next().unwrap();
    for finding in ["warning: 1 of 8 views are left out", "note: 7 masks, white = refractive"] {
        assert_eq!(before.matches(finding).count(), 1, "{}", told.err);
    }
}
