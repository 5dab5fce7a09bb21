//! Masks from what somebody points at.

use crate::common::*;
use refraxel_data::{Dataset, OpenOptions, Photo, load_photo};
use std::path::{Path, PathBuf};

/// Options that make finding a matter of seconds.
const QUICK: [&str; 2] = ["--set", "detection.rays=120000"];

/// A glass ball without masks and truth, and its true masks by view.
fn unmasked(folder: &Path) -> (PathBuf, Vec<Photo>) {
    let data = glass(folder);
    let opened = Dataset::open(&data, &OpenOptions::default()).unwrap();
    let photos = opened.views.iter().map(|v| load_photo(v).unwrap()).collect();
    std::fs::remove_dir_all(data.join("masks")).unwrap();
    std::fs::remove_file(data.join("scene.json")).unwrap();
    (data, photos)
}

fn mask(data: &Path, more: &[&str]) -> Ran {
    let words = [&["mask", path(data), "--quiet", "--json"], &QUICK[..], more].concat();
    refraxel(&words)
}

#[test]
fn an_outline_in_two_photographs_becomes_masks_of_all() {
    let folder = tempfile::tempdir().unwrap();
    let (data, truth) = unmasked(folder.path());
    let opened = Dataset::open(&data, &OpenOptions::default()).unwrap();
    let view = |name: &str| opened.views.iter().position(|v| v.name == name).unwrap();
    let mut words = Vec::new();
    for name in ["r_10.png", "r_20.png"] {
        words.extend(["--outline".to_owned(), name.to_owned()]);
        words.extend(around(&truth[view(name)]));
    }
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let made = mask(&data, &words).done().json();
    assert_eq!((&made["written"], &made["kept"]), (&33.into(), &0.into()));
    assert!(data.join("glass_masks_overview.png").is_file());
    let found = Dataset::open(&data, &OpenOptions::default()).unwrap();
    assert!(found.views.iter().all(|v| v.has_mask()), "the program finds what it has written");
    let overlaps: Vec<f64> =
        found.views.iter().zip(&truth).map(|(v, t)| overlap(&load_photo(v).unwrap(), t)).collect();
    let mean = overlaps.iter().sum::<f64>() / overlaps.len() as f64;
    assert!(mean > 0.6, "{mean}: {overlaps:?}");
    mask(&data, &[]).refused(3, &["30 training views have masks", "--overwrite"]);
    // Masks that were deleted are made anew, with the help of the others, which stay as they are.
    let (good, bad) = (data.join("glass_masks/train/r_10.png"), data.join("glass_masks/train/r_4.png"));
    let before = std::fs::read(&good).unwrap();
    std::fs::remove_file(&bad).unwrap();
    let again = mask(&data, &[]).done().json();
    assert_eq!((&again["written"], &again["kept"]), (&1.into(), &32.into()));
    assert!(bad.is_file() && std::fs::read(&good).unwrap() == before);
    let anew = mask(&data, &["--overwrite"]).done().json();
    assert_eq!((&anew["written"], &anew["kept"]), (&33.into(), &0.into()));
}

/// Eight corners around the white of a mask.
fn around(photo: &Photo) -> Vec<String> {
    let mask = photo.mask.as_ref().unwrap();
    let width = mask.width as usize;
    let white: Vec<[f64; 2]> = (0..mask.coverage.len())
        .filter(|&p| mask.coverage[p] > 127)
        .map(|p| [(p % width) as f64 + 0.5, (p / width) as f64 + 0.5])
        .collect();
    let middle = [0, 1].map(|a| white.iter().map(|w| w[a]).sum::<f64>() / white.len() as f64);
    let radius = (white.len() as f64 / std::f64::consts::PI).sqrt();
    let corner = |k: u32| {
        let angle = f64::from(k) * std::f64::consts::FRAC_PI_4;
        format!("{:.2},{:.2}", middle[0] + radius * angle.cos(), middle[1] + radius * angle.sin())
    };
    (0..8).map(corner).collect()
}

/// Intersection over union of two masks.
fn overlap(a: &Photo, b: &Photo) -> f64 {
    let white = |p: &Photo| p.mask.as_ref().unwrap().coverage.iter().map(|c| *c > 127).collect::<Vec<_>>();
    let pairs: Vec<(bool, bool)> = white(a).into_iter().zip(white(b)).collect();
    let both = pairs.iter().filter(|(a, b)| *a && *b).count();
    both as f64 / pairs.iter().filter(|(a, b)| *a || *b).count().max(1) as f64
}

#[test]
fn what_cannot_be_pointed_at_is_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    let data = ball(folder.path());
    mask(&data, &[]).refused(3, &["5 training views have masks"]);
    std::fs::remove_dir_all(data.join("masks")).unwrap();
    mask(&data, &["--set", "detection.separation=1"]).refused(3, &["--click VIEW X Y"]);
    mask(&data, &["--click", "IMG_7.jpg", "1", "1"]).refused(2, &["IMG_7.jpg", "r_0.png"]);
    mask(&data, &["--click", "r_3.png", "1", "99"]).refused(2, &["(1, 99)", "16 x 16 pixels"]);
    mask(&data, &["--click", "r_3.png", "left", "9"]).refused(2, &["'left'", "number of pixels"]);
    mask(&data, &["--outline", "r_3", "1,1", "2,2", "r_4", "3,3"]).refused(2, &["r_3.png has 2 points"]);
    mask(&data, &["--box", "r_3.png", "20", "20", "30", "30"]).refused(2, &["holds no pixel"]);
    assert!(!data.join("glass_masks").exists());
}
