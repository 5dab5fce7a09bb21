//! The same photographs in other coordinates: far from the origin of the world, and in other units of length.

use crate::scenes::{begun, events, options_with, written};
use refraxel_core::{Vec3, vec3};
use refraxel_data::{Dataset, LocalOrigin, PosedPhoto, View, load_photo};
use refraxel_train::events::Event;
use refraxel_train::options::Switch;
use refraxel_train::run::Run;
use refraxel_train::session::{Session, Setup, Until};
use refraxel_train::{CpuBackend, Options};
use std::sync::OnceLock;
use tempfile::TempDir;

/// A small glass ball with masks, in the units and at the place of its world.
fn glass_ball() -> &'static Dataset {
    static DATA: OnceLock<(TempDir, Dataset)> = OnceLock::new();
    &DATA.get_or_init(|| written("glass_ball", 24, [16, 0, 1], |_| {})).1
}

/// The glass ball in a world in which all lengths are so much larger, and whose origin is elsewhere.
fn placed(scale: f64, at: Vec3<f64>) -> Dataset {
    let data = glass_ball();
    let photo = |view: &View| {
        let mut camera = view.camera;
        camera.world_from_camera.translation = camera.world_from_camera.translation * scale + at;
        let (photo, name) = (load_photo(view).unwrap(), view.name.clone());
        PosedPhoto { name, camera, photo, mask_meaning: view.mask_meaning }
    };
    let photos = data.views.iter().map(photo).collect();
    Dataset::in_memory(photos, data.split.clone(), data.backdrop).unwrap()
}

/// A few steps, straight or bent by a ball in its box.
fn options(bend: Switch, scale: f64, at: Vec3<f64>) -> Options {
    let middle = vec3(0.02, -0.03, -0.13);
    let corner = |s: f64| {
        let [x, y, z] = ((middle + Vec3::splat(s * 0.5)) * scale + at).to_array();
        format!("{x},{y},{z}")
    };
    let mut options = options_with(&[
        ("run.steps", "8"),
        ("run.batch", "64"),
        ("grid.resolution", "16"),
        ("grid.stages", "1"),
        ("refraction.straight_steps", "3"),
        ("shape.start", "ball"),
        ("search.enabled", "off"),
        ("detection.enabled", "off"),
        ("refraction.bounds", &format!("{},{}", corner(-1.0), corner(1.0))),
    ]);
    options.refraction.bend = bend;
    options.judge.straight = Switch::Off;
    options
}

/// The session after its run, and what happened.
fn trained(bend: Switch, scale: f64, at: Vec3<f64>) -> (Session, Vec<Event>) {
    let setup = Setup::new(placed(scale, at), options(bend, scale, at));
    let mut session = begun(setup);
    let events = events(&mut session, Until::finished());
    (session, events)
}

/// PSNR of the training rays [dB], and the index where rays bend.
fn result(events: &[Event]) -> Vec<f64> {
    let mut records =
        events.iter().rev().filter_map(|e| if let Event::Record(r) = e { Some(r) } else { None });
    let last = records.next().unwrap();
    [last.train_psnr].into_iter().chain(last.index.iter().copied()).collect()
}

/// Rounding in single precision, over some steps that amplify it.
const ROUNDING: f64 = 2e-3;

fn is_near(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < ROUNDING)
}

#[test]
fn scenes_of_micrometres_and_of_kilometres_train_alike() {
    for bend in [Switch::Off, Switch::On] {
        let of = |scale: f64| result(&trained(bend, scale, Vec3::zero()).1);
        let expected = of(1.0);
        assert_eq!(expected.len(), if bend.is_on() { 2 } else { 1 }, "rays bend where they shall");
        for scale in [1e-6, 1e6] {
            let found = of(scale);
            assert!(is_near(&found, &expected), "{bend:?} {scale}: {found:?} instead of {expected:?}");
        }
    }
}

#[test]
fn scenes_far_from_the_origin_of_their_world_train_as_if_they_were_there() {
    let utm = vec3(471_000.3, 5_270_000.7, 530.1);
    let [(near, here), (far, there)] = [Vec3::zero(), utm].map(|at| trained(Switch::On, 1.0, at));
    let [found, expected] = [&there, &here].map(|events| result(events));
    assert!(is_near(&found, &expected), "{found:?} instead of {expected:?}");
    let region = |session: &Session| {
        let plan = session.snapshot().plan;
        plan.origin.to_world(plan.finest.bounds.cast::<f64>())
    };
    let [a, b] = [&near, &far].map(region);
    assert!((b.min - a.min - utm).length() < 1e-5 && (b.max - a.max - utm).length() < 1e-5, "{a:?} {b:?}");
    let center = |events: &[Event]| {
        let found = events
            .iter()
            .find_map(|e| if let Event::RegionFound { center, .. } = e { Some(*center) } else { None });
        Vec3::from(found.unwrap())
    };
    assert!((center(&there) - center(&here) - utm).length() < 1e-5, "told in the user's world");
}

#[test]
fn a_run_goes_on_at_the_origin_where_it_began() {
    let at = vec3(-3000.0, 0.25, 2000.0);
    let (session, _) = trained(Switch::On, 1.0, at);
    let mut saved = Vec::new();
    session.snapshot().view().write(&mut saved).unwrap();
    let run = Run::read(&saved[..]).unwrap();
    assert!(!run.plan.origin.is_of_world() && run.plan == session.snapshot().plan);
    // Data that somebody opened relative to another point are the same data.
    let data = placed(1.0, at).with_origin(LocalOrigin::at(at));
    let mut longer = options(Switch::On, 1.0, at);
    longer.run.steps = 10;
    let origin = run.plan.origin;
    let resumed = Session::resume(Setup::new(data, longer), run, CpuBackend::resumed, &mut |_| {}).unwrap();
    assert_eq!(resumed.data().origin, origin);
}
