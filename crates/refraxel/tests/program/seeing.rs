//! Pictures of the index of refraction, and renderings with another one.

use super::runs::{bent, data, straight};
use crate::common::*;
use refraxel_data::photographs::stored_pixels;
use refraxel_data::synth::{SynthOptions, ViewCounts, synthesize};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

#[test]
fn a_run_is_evaluated_with_the_index_of_a_file() {
    let (folder, data, run) = (tempfile::tempdir().unwrap(), data(), bent());
    let own = std::fs::read(run.join("eval/test/metrics.json")).unwrap();
    let eval = |file: &Path| refraxel(&["eval", path(run), "--index-from", path(file), "--quiet", "--json"]);
    let report = eval(&data.join("scene.json")).done().json();
    // The run has the same shape on a coarser grid.
    let (exact, of_run) = (
        report["psnr"].as_f64().unwrap(),
        json_of(&run.join("eval/test/metrics.json"))["psnr"].as_f64().unwrap(),
    );
    assert!((exact - of_run).abs() < 0.5, "{exact} {of_run}");
    assert!(report["ior"]["mae_inside"].as_f64().unwrap() < 1e-4);
    let document = json_of(&run.join("eval/test-index/metrics.json"));
    assert_eq!(document, report);
    assert!(document["run"]["index_from"].as_str().unwrap().ends_with("scene.json"));
    assert_eq!(std::fs::read(run.join("eval/test/metrics.json")).unwrap(), own, "the run's own scores stay");
    // Another body bends otherwise.
    let picture = || pixels(&run.join("eval/test-index/r_0.png"));
    let as_glass = picture();
    let water = folder.path().join("water.json");
    let text = std::fs::read_to_string(data.join("scene.json")).unwrap();
    std::fs::write(&water, text.replace("1.5", "1.2")).unwrap();
    let report = eval(&water).done().json();
    assert!((report["ior"]["mean_inside"].as_f64().unwrap() - 1.2).abs() < 1e-3, "{}", report["ior"]);
    assert!(picture() != as_glass);
    eval(&data.join("r_0.png")).refused(3, &["r_0.png"]);
    eval(&folder.path().join("no.json")).refused(3, &["no.json"]);
}

fn render(run: &Path, out: &Path, more: &[&str]) -> Ran {
    refraxel(&[&["render", path(run), "--out", path(out), "--quiet"], more].concat())
}

fn pixels(file: &Path) -> image::RgbImage {
    stored_pixels(file).unwrap().into_rgb8()
}

#[test]
fn a_bent_run_shows_its_index() {
    let (folder, data, run) = (tempfile::tempdir().unwrap(), data(), bent());
    let out = folder.path().join("out");
    let cameras = data.join("transforms_test.json");
    let words = ["--cameras", path(&cameras), "--outputs", "colour,index,normal,surface-depth", "--slices"];
    let words = [&words[..], &["--paths", "5"]].concat();
    let report = render(run, &out, &[&words[..], &["--json"]].concat()).done().json();
    assert_eq!((&report["views"], &report["truth_shown"]), (&2.into(), &true.into()));
    for file in ["r_0.png", "index_preview/r_0.png", "index_slices.png", "paths.png", "transforms.json"] {
        assert!(out.join(file).is_file(), "{file}");
    }
    let index = stored_pixels(out.join("index/r_0.png")).unwrap();
    assert_eq!(index.color(), image::ColorType::L16);
    let largest = index.into_luma16().pixels().map(|p| p.0[0]).max().unwrap();
    assert!(largest.abs_diff(15_000) < 20, "{largest}");
    let normal = stored_pixels(out.join("normal/r_0.png")).unwrap().into_rgba8();
    let met = |p: &&image::Rgba<u8>| p.0[3] == 255;
    assert!(normal.pixels().any(|p| p.0 == [0; 4]));
    assert!(normal.pixels().filter(met).count() > 4 && normal.pixels().filter(met).all(|p| p.0[2] >= 127));
    let notes = json_of(&out.join("transforms.json"));
    assert!(out.join("surface_depth_preview/r_0.png").is_file());
    let depth = stored_pixels(out.join("surface_depth/r_0.png")).unwrap();
    assert_eq!(depth.color(), image::ColorType::L16);
    // The nearest point of the ball as the camera sees it.
    let scene = json_of(&data.join("scene.json"));
    let (ball, m) = (&scene["refractive"][0], &notes["frames"][0]["transform_matrix"]);
    let off = (0..3).map(|a| m[a][3].as_f64().unwrap() - ball["center"][a].as_f64().unwrap());
    let nearest = off.map(|d| d * d).sum::<f64>().sqrt() - ball["radius"].as_f64().unwrap();
    let depths: Vec<u16> = depth.into_luma16().pixels().map(|p| p.0[0]).collect();
    let least = f64::from(depths.iter().copied().filter(|&d| d > 0).min().unwrap());
    let least = least * notes["surface_depth"]["unit"].as_f64().unwrap();
    assert!(least > nearest - 0.05 && least < nearest + 0.1, "{least} {nearest}");
    assert_eq!(depths.iter().filter(|&&d| d > 0).count(), normal.pixels().filter(met).count());
    let lines = std::fs::read_to_string(out.join("paths.ply")).unwrap();
    assert!(lines.starts_with("ply\nformat ascii 1.0\ncomment 5 bent rays"), "{lines}");
    assert_eq!(notes["index"]["unit"].as_f64(), Some(1e-4));
}

#[test]
fn slices_need_no_views_and_no_dataset() {
    let (folder, data, run) = ball_and("bent");
    train_with_index(&data, &run, &data.join("scene.json"), &[]);
    let out = folder.path().join("out");
    std::fs::rename(&data, folder.path().join("moved")).unwrap();
    let text = render(&run, &out, &["--slices"]).done().out;
    assert!(text.contains("the truth is not known") && out.join("index_slices.png").is_file(), "{text}");
    assert!(!out.join("transforms.json").exists());
}

#[test]
fn a_second_render_never_mixes_with_the_first() {
    let (folder, run) = (tempfile::tempdir().unwrap(), bent());
    let out = folder.path().join("out");
    render(run, &out, &["--orbit", "3", "--outputs", "colour,depth", "--slices", "--paths", "2"]).done();
    std::fs::write(out.join("notes.txt"), "mine").unwrap();
    let before = std::fs::read(out.join("0000.png")).unwrap();
    let again = ["--orbit", "2", "--scale-index", "0"];
    render(run, &out, &again).refused(3, &["an earlier render", "0000.png", "--overwrite"]);
    assert_eq!(std::fs::read(out.join("0000.png")).unwrap(), before);
    render(run, &out, &[&again[..], &["--overwrite"]].concat()).done();
    let mut left: Vec<String> = std::fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    left.sort();
    assert_eq!(left, ["0000.png", "0001.png", "notes.txt", "render_files.txt", "transforms.json"]);
    assert!(std::fs::read(out.join("0000.png")).unwrap() != before, "the rays are straight now");
}

#[test]
fn files_of_the_user_are_never_rendered_over() {
    let (folder, run) = (tempfile::tempdir().unwrap(), bent());
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("transforms.json"), "mine").unwrap();
    render(run, &out, &["--orbit", "1", "--overwrite"]).refused(3, &["transforms.json", "never removed"]);
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 1, "nothing was written");
    // Where no file of that name is written, it is not in the way.
    render(run, &out, &["--slices"]).done();
    assert_eq!(std::fs::read_to_string(out.join("transforms.json")).unwrap(), "mine");
}

#[test]
fn the_index_that_a_run_has_changes_no_pixel_and_the_run_stays_as_it_is() {
    let (folder, data, run) = ball_and("bent");
    train_with_index(&data, &run, &data.join("scene.json"), &["--set", "search.profile=sharp"]);
    let checkpoint = || std::fs::read(run.join(refraxel_train::run::CHECKPOINT)).unwrap();
    let (before, cameras) = (checkpoint(), data.join("transforms_test.json"));
    let picture = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        render(&run, &out, &[&["--cameras", path(&cameras)], more].concat()).done();
        pixels(&out.join("r_1.png"))
    };
    let usual = picture("usual", &[]);
    assert_eq!(picture("same", &["--set-index", "1.5"]), usual);
    assert_eq!(picture("once", &["--scale-index", "1"]), usual);
    assert_ne!(picture("water", &["--set-index", "1.33"]), usual);
    assert_eq!(picture("two_thirds", &["--scale-index", "0.5"]), picture("thin", &["--set-index", "1.25"]));
    assert_eq!(checkpoint(), before);
}

/// A ball of which little is textured but all refracts: another index gives another picture.
fn ball_of(folder: &Path, ior: f64) -> PathBuf {
    let out = folder.join(format!("ball_{ior}"));
    let views = ViewCounts { train: 24, val: 1, test: 3 };
    let usual = SynthOptions::new("glass_ball", &out);
    let options =
        SynthOptions { size: 40, views, spp: 1, detail_spp: 0, index_resolution: 0, ior: Some(ior), ..usual };
    synthesize(&options, &|_| ControlFlow::Continue(())).unwrap();
    out
}

#[test]
fn a_run_with_another_index_looks_like_the_truth_with_that_index() {
    let folder = tempfile::tempdir().unwrap();
    let (glass, thin) = (ball_of(folder.path(), 1.5), ball_of(folder.path(), 1.1));
    let more = ["--set", "steps=250", "--set", "grid.resolution=40", "--set", "batch=1024"];
    let (run, cameras) = (folder.path().join("bent"), thin.join("transforms_test.json"));
    train_with_index(&glass, &run, &glass.join("scene.json"), &more);
    let error = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        render(&run, &out, &[&["--cameras", path(&cameras)], more].concat()).done();
        let of_view = |k: usize| {
            let (a, b) =
                (pixels(&out.join(format!("r_{k}.png"))), pixels(&thin.join(format!("test/r_{k}.png"))));
            let mask = stored_pixels(thin.join(format!("masks/test/r_{k}.png"))).unwrap().into_luma8();
            let inside = a.pixels().zip(b.pixels()).zip(mask.pixels()).filter(|(_, m)| m.0[0] > 127);
            inside
                .map(|((a, b), _)| (0..3).map(|c| f64::from(a.0[c].abs_diff(b.0[c])).powi(2)).sum::<f64>())
                .sum::<f64>()
        };
        (0..3).map(of_view).sum::<f64>()
    };
    let (edited, usual) = (error("edited", &["--set-index", "1.1"]), error("usual", &[]));
    assert!(edited < 0.7 * usual, "squared error with the other index {edited}, without {usual}");
}

#[test]
fn straight_runs_have_no_index_to_show_or_change() {
    let (folder, run) = (tempfile::tempdir().unwrap(), straight());
    let out = folder.path().join("out");
    let one = ["--orbit", "1"];
    for (flags, word) in [
        (&["--orbit", "1", "--set-index", "1.33"][..], "cannot be changed"),
        (&["--orbit", "1", "--scale-index", "0.5"], "cannot be changed"),
        (&["--orbit", "1", "--outputs", "colour,normal"], "--outputs normal"),
        (&["--orbit", "1", "--outputs", "surface-depth"], "--outputs surface-depth"),
        (&["--slices"], "--slices"),
        (&["--paths", "3"], "--paths"),
    ] {
        render(run, &out, flags).refused(3, &[word, "straight"]);
    }
    assert!(is_without_files(&out));
    render(run, &out, &[&one[..], &["--set-index", "0.1"]].concat())
        .refused(2, &["--set-index", "1.5 for glass"]);
    render(run, &out, &[&one[..], &["--scale-index", "NaN"]].concat()).refused(2, &["--scale-index"]);
    render(run, &out, &[]).refused(2, &["--slices"]);
}

#[test]
fn an_index_beyond_all_matter_is_refused() {
    let (folder, run) = (tempfile::tempdir().unwrap(), bent());
    let out = folder.path().join("out");
    render(run, &out, &["--orbit", "1", "--scale-index", "50"]).refused(3, &["26.00", "expected 0.25 to 4"]);
    assert!(is_without_files(&out));
}

#[test]
fn comparisons_say_how_rays_go() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("sheet");
    let words = ["compare", path(straight()), path(bent()), "--truth", "--out", path(&out)];
    let text = refraxel(&words).done().out;
    let heading = text.lines().next().unwrap();
    for word in ["rays", "inside", "outside", "index inside", "true index", "index error inside"] {
        assert!(heading.contains(word), "{heading}");
    }
    let table = refraxel(&[&words[..], &["--json"]].concat()).done().json();
    assert_eq!((&table["runs"][0]["rays"], &table["runs"][1]["rays"]), (&"straight".into(), &"bent".into()));
    assert!((table["runs"][1]["ior"]["mean_inside"].as_f64().unwrap() - 1.5).abs() < 0.01);
}
