//! Data in which only some views have masks.

use crate::scenes::{begun, options_with, written};
use refraxel_data::{Dataset, PhotoSource};
use refraxel_train::events::Event;
use refraxel_train::session::{Setup, Until};
use tempfile::TempDir;

/// A glass ball in 24 training views, with its masks.
fn masked() -> (TempDir, Dataset) {
    written("glass_ball", 32, [24, 0, 2], |_| {})
}

/// The same data with the masks of every so many-th training view only.
fn with_every(data: &Dataset, nth: usize) -> Dataset {
    let mut some = data.clone();
    for (k, &view) in data.split.train.iter().enumerate().filter(|(k, _)| k % nth != 0) {
        let PhotoSource::Files { mask, .. } = &mut some.views[view].source else { panic!("view {k}") };
        *mask = None;
    }
    some
}

/// What a run of few steps tells of masks: how many there are, whether the others were completed, and the share of pixels inside.
fn completed(data: Dataset) -> Option<(usize, bool, f64)> {
    let short = [("run.steps", "40"), ("run.batch", "128"), ("grid.resolution", "16")];
    let options = options_with(&[&short[..], &[("refraction.bend", "on")]].concat());
    let mut session = begun(Setup::new(data, options));
    let mut told = None;
    let mut note = |event: Event| {
        if let Event::MasksCompleted { stated, is_completed, pixels, .. } = event {
            assert!(told.is_none(), "told once");
            told = Some((stated, is_completed, pixels));
        }
    };
    session.run(Until::step(3), &mut note).unwrap();
    told
}

#[test]
fn masks_of_some_views_say_what_the_others_show() {
    let (_folder, data) = masked();
    let photos = data.load_photos(&data.split.train, |_| {}).unwrap();
    let white =
        |p: &refraxel_data::Photo| p.mask.as_ref().unwrap().coverage.iter().filter(|c| **c > 127).count();
    let truth = photos.iter().map(white).sum::<usize>() as f64 / (24.0 * 32.0 * 32.0);
    let (stated, is_completed, pixels) = completed(with_every(&data, 3)).unwrap();
    assert_eq!((stated, is_completed), (8, true));
    // Of 8 views at least three quarters must agree: the hull is larger than the ball.
    assert!(pixels > truth && pixels < 1.35 * truth, "{pixels} {truth}");
    let (stated, is_completed, pixels) = completed(with_every(&data, 12)).unwrap();
    assert_eq!((stated, is_completed), (2, false));
    assert!(pixels < 0.2 * truth, "two masks of 24: {pixels} {truth}");
    assert_eq!(completed(data), None, "nothing is missing");
}
