//! Cameras that find where they are.

use crate::scenes::{begun, options_with, written};
use refraxel_core::{Lens, Mat3, Pose, vec3};
use refraxel_data::{Dataset, Part};
use refraxel_train::Options;
use refraxel_train::options::Switch;
use refraxel_train::random::Random;
use refraxel_train::session::{Session, Setup, Until};
use std::sync::OnceLock;
use tempfile::TempDir;

/// Opaque things.
fn truth() -> &'static Dataset {
    static DATA: OnceLock<(TempDir, Dataset)> = OnceLock::new();
    &DATA.get_or_init(|| written("opaque", 64, [36, 1, 3], |o| o.spp = 4)).1
}

/// The same with cameras that are off by half a degree and one part in a hundred of their distance.
fn disturbed() -> Dataset {
    let (mut off, random) = (truth().clone(), Random::new(3));
    for (view, k) in off.views.iter_mut().zip(0..) {
        let direction = |i: u64| {
            let number = |j| random.uniform(k, i + j) - 0.5;
            vec3(number(0), number(1), number(2)).normalized()
        };
        let Pose { rotation, translation } = view.camera.world_from_camera;
        let distance = translation.length();
        view.camera.world_from_camera = Pose {
            rotation: Mat3::turning(direction(0) * 0.5_f64.to_radians()) * rotation,
            translation: translation + direction(3) * (0.01 * distance),
        };
    }
    off
}

fn trained(data: &Dataset, learn: Switch) -> Session {
    trained_with(data, learn, Switch::Off)
}

fn trained_with(data: &Dataset, learn: Switch, lens: Switch) -> Session {
    let mut options = options_with(&[("run.steps", "300"), ("run.batch", "2048"), ("grid.resolution", "64")]);
    options.refraction.bend = Switch::Off;
    options.pose.enabled = learn;
    options.pose.lens = lens;
    let mut session = begun(Setup::new(data.clone(), options));
    session.run(Until::finished(), &mut |_| {}).unwrap();
    session
}

fn psnr(session: &Session) -> f64 {
    let found = session.evaluate(Part::Test, &mut |_| {}, &mut |_, _| {}).unwrap();
    found.scores.psnr.unwrap()
}

#[test]
fn disturbed_cameras_find_back_and_held_out_views_are_posed() {
    let off = disturbed();
    let exact = psnr(&trained(truth(), Switch::Off));
    let fixed = psnr(&trained(&off, Switch::Off));
    let session = trained(&off, Switch::On);
    let learned = psnr(&session);
    assert!(learned > fixed + 0.6 * (exact - fixed) && exact > fixed + 1.0, "{exact} {fixed} {learned}");
    let shift = session.snapshot().alignment.poses.unwrap().shift();
    assert!(shift.median_turn > 0.1 && shift.largest_turn < 2.0, "{shift:?}");
}

#[test]
fn a_wrong_lens_learns_towards_the_true_one_and_held_out_views_have_it() {
    let mut wrong = truth().clone();
    for view in &mut wrong.views {
        view.camera.lens = Lens::OpenCv { k: [0.15, 0.0, 0.0, 0.0], p: [0.0; 2] };
    }
    let fixed = psnr(&trained(&wrong, Switch::On));
    let session = trained_with(&wrong, Switch::On, Switch::On);
    let learned = psnr(&session);
    let alignment = session.snapshot().alignment;
    let lens = alignment.poses.as_ref().unwrap().shift().lens.unwrap();
    let held_out = alignment.cameras(&wrong)[wrong.split.test[0]].lens;
    assert_eq!(held_out, Lens::OpenCv { k: [0.15 + lens.radial, 0.0, 0.0, 0.0], p: [0.0; 2] });
    assert!(
        (-0.2..-0.05).contains(&lens.radial) && (lens.focal - 1.0).abs() < 0.02,
        "{lens:?} {fixed} {learned}"
    );
    assert!(learned > fixed - 0.3, "as well as poses that give way: {fixed} {learned}");
}

#[test]
fn a_lens_does_not_learn_alone() {
    let mut options = Options::default();
    options.pose.lens = Switch::On;
    let refused =
        |options: &Options| Setup::new(truth().clone(), options.clone()).check().unwrap_err().to_string();
    assert!(refused(&options).contains("--poses learn"));
    options.pose.enabled = Switch::On;
    assert!(Setup::new(truth().clone(), options).check().is_ok());
}
