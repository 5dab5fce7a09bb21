//! `inspect` names the photographs and cameras that spoil a reconstruction, and draws all of them.

use super::runs::straight;
use crate::common::*;
use image::{GrayImage, Luma, imageops};
use refraxel_data::photographs::stored_pixels;
use refraxel_data::synth::{Elevations, cameras, opengl_matrix};
use serde_json::{Value, json};
use std::path::Path;
use tempfile::TempDir;

const SIDE: u32 = 32;
const VIEWS: usize = 12;

/// Squares of a grey of their own, other ones in each view.
fn squares(view: usize) -> GrayImage {
    let grey = |x: u32, y: u32| {
        let seed = (x / 4) * 73 + (y / 4) * 151 + view as u32 * 1009;
        (seed.wrapping_mul(2_654_435_761) >> 16) as u8 / 2 + 60
    };
    GrayImage::from_fn(SIDE, SIDE, |x, y| Luma([grey(x, y)]))
}

fn name(view: usize) -> String {
    format!("r_{view}.png")
}

/// Posed pictures of squares, changed by `edit`; files are written afterwards where `draw` gives other ones.
fn dataset(edit: impl FnOnce(&mut Value), draw: impl Fn(usize) -> GrayImage) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let cameras = cameras(Elevations::UPPER, VIEWS, 1, [SIDE, SIDE]);
    let frame = |(i, c)| json!({ "file_path": name(i), "transform_matrix": opengl_matrix(c) });
    let frames: Vec<Value> = cameras.iter().enumerate().map(frame).collect();
    let mut value = json!({ "fl_x": 44.0, "fl_y": 44.0, "w": SIDE, "h": SIDE, "frames": frames });
    edit(&mut value);
    std::fs::write(folder.path().join("transforms.json"), value.to_string()).unwrap();
    for view in 0..VIEWS {
        draw(view).save(folder.path().join(name(view))).unwrap();
    }
    folder
}

/// All that is said of a view in the JSON.
fn warnings(report: &Value, view: usize) -> String {
    let views = report["photographs"].as_array().unwrap();
    let view = views.iter().find(|v| v["name"] == name(view)).unwrap();
    view["warnings"].to_string()
}

fn inspect(folder: &Path, more: &[&str]) -> Ran {
    refraxel(&[&["inspect", path(folder)], more].concat()).done()
}

#[test]
fn blurred_dark_and_repeated_photographs_are_named_with_a_remedy() {
    let darkened =
        |picture: GrayImage| GrayImage::from_fn(SIDE, SIDE, |x, y| Luma([picture.get_pixel(x, y)[0] / 3]));
    let folder = dataset(
        |_| {},
        |view| match view {
            2 => imageops::blur(&squares(2), 1.5),
            5 => darkened(squares(5)),
            9 => squares(3),
            _ => squares(view),
        },
    );
    let report = inspect(folder.path(), &["--json"]).json();
    for (view, words) in [
        (2, &["is blurred", "of the median of its neighbours", "leave it out"][..]),
        (5, &["stops darker than its neighbours", "--exposure learn"]),
        (9, &["r_9.png and r_3.png show the same picture", "one of the poses is wrong"]),
    ] {
        let found = warnings(&report, view);
        assert!(words.iter().all(|w| found.contains(w)), "{view}: {found}");
    }
    for view in [0, 1, 3, 4, 6, 7, 8, 10, 11] {
        assert_eq!(warnings(&report, view), "[]", "{view}");
    }
    let text = inspect(folder.path(), &[]).out;
    for words in ["looked at  12 of 12 photographs", "warning    r_2.png is blurred", "warning    r_5.png is"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn pictures_are_written_where_asked_for_and_nowhere_else() {
    let folder = dataset(|_| {}, squares);
    let before = std::fs::read_dir(folder.path()).unwrap().count();
    let out = folder.path().join("pictures/of it");
    inspect(folder.path(), &[]);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), before, "nothing is written unasked");
    let report = inspect(folder.path(), &["--out", path(&out), "--json"]).json();
    for (key, least) in [("photographs", 500), ("cameras", 1500), ("views", 1000)] {
        let file = report["pictures"][key].as_str().unwrap();
        assert!(Path::new(file).starts_with(&out), "{file}");
        assert!(stored_pixels(file).unwrap().width() > least, "{file}");
    }
    let first = &report["photographs"][0];
    assert_eq!(
        (&first["name"], &first["part"], &first["mask"]),
        (&json!("r_0.png"), &json!("test"), &Value::Null)
    );
    for key in ["brightness", "sharpness", "sharpness_ratio", "stops"] {
        assert!(first[key].is_number(), "{key}: {first}");
    }
    let text = inspect(folder.path(), &["--out", path(&out)]).out;
    assert!(text.contains("inspect_cameras.png"), "{text}");
}

#[test]
fn photographs_that_cannot_be_decoded_are_all_named() {
    let folder = dataset(|_| {}, squares);
    for view in [4, 7] {
        let file = folder.path().join(name(view));
        // In the middle of its pixels: what is cut off is found before, and left out.
        let mut bytes = std::fs::read(&file).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0xff;
        std::fs::write(&file, bytes).unwrap();
    }
    let out = folder.path().join("pictures");
    let report = inspect(folder.path(), &["--json", "--out", path(&out)]).json();
    for view in [4, 7] {
        let found = warnings(&report, view);
        assert!(found.contains("cannot decode") && found.contains(&name(view)), "{found}");
    }
}

#[test]
fn cameras_that_stand_alone_or_look_away_are_named() {
    let folder = dataset(
        |value| {
            let far = &mut value["frames"][4]["transform_matrix"];
            (0..3).for_each(|row| far[row][3] = json!(80.0));
            let away = &mut value["frames"][7]["transform_matrix"];
            for (row, column) in [(0, 0), (1, 0), (2, 0), (0, 2), (1, 2), (2, 2)] {
                away[row][column] = json!(-away[row][column].as_f64().unwrap());
            }
        },
        squares,
    );
    let report = inspect(folder.path(), &["--json"]).json();
    assert!(warnings(&report, 4).contains("stands alone"), "{}", warnings(&report, 4));
    assert!(warnings(&report, 7).contains("looks away from the scene"), "{}", warnings(&report, 7));
}

#[test]
fn masks_that_say_nothing_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    let mask = data.join("masks/train/r_1.png");
    assert!(mask.is_file());
    GrayImage::new(16, 16).save(&mask).unwrap();
    let report = inspect(&data, &["--json"]).json();
    let of = |name: &str| {
        let views = report["photographs"].as_array().unwrap();
        views.iter().find(|v| v["name"] == name && v["part"] == "train").unwrap().clone()
    };
    let empty = of("train/r_1.png");
    assert!(empty["mask"] == 0.0 && empty["warnings"].to_string().contains("is empty"), "{empty}");
    assert!(of("train/r_2.png")["mask"].as_f64().unwrap() > 0.0);
}

#[test]
fn runs_are_not_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("pictures");
    refraxel(&["inspect", path(straight()), "--out", path(&out)]).refused(2, &["--out", "is a run"]);
    assert!(!out.exists());
}
