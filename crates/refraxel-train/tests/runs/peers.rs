//! Processes that train one model together: the same bits as one, and messages of the size that was foreseen.

use crate::scenes::{begun, options_with, written};
use refraxel_core::{Camera, Extent, VoxelField, vec3};
use refraxel_data::Dataset;
use refraxel_train::backend::conformance::scenes;
use refraxel_train::backend::step;
use refraxel_train::communicator::{Communicator, Traffic, threads};
use refraxel_train::cpu::{Root, SharedBackend, serve};
use refraxel_train::model::Model;
use refraxel_train::options::Switch;
use refraxel_train::run::{Run, State};
use refraxel_train::session::{Session, Setup, Until};
use refraxel_train::{Backend, Options};
use std::any::Any;
use std::sync::{Arc, OnceLock};
use tempfile::TempDir;

/// A small scene with masks.
fn data() -> Dataset {
    static DATA: OnceLock<(TempDir, Dataset)> = OnceLock::new();
    let (_, data) = DATA.get_or_init(|| written("glass_ball", 32, [16, 1, 2], |o| o.index_resolution = 16));
    data.clone()
}

fn options(settings: &[(&str, &str)]) -> Options {
    let usual =
        [("run.steps", "60"), ("run.batch", "2048"), ("grid.resolution", "32"), ("straight_steps", "20")];
    options_with(&[&usual[..], settings].concat())
}

/// A run to its end: what it has learned, what a camera sees, and what its processes have sent, where there are several.
fn trained(mut session: Session) -> (Vec<u8>, Vec<[u8; 3]>, Option<Traffic>) {
    session.run(Until::finished(), &mut |_| {}).unwrap();
    let eye = Camera::look_at(vec3(3.0, 1.0, 2.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), 0.7, [40, 30]);
    let colours = session.render(&eye).unwrap().colour;
    let mut run = session.snapshot();
    run.state.seconds = 0.0;
    run.state.verdict.iter_mut().for_each(|v| v.seconds = 0.0);
    let mut bytes = Vec::new();
    run.view().write(&mut bytes).unwrap();
    let backend: &dyn Any = session.backend();
    (bytes, colours, backend.downcast_ref().map(SharedBackend::traffic))
}

fn alone(options: &Options) -> (Vec<u8>, Vec<[u8; 3]>) {
    let (bytes, seen, _) = trained(begun(Setup::new(data(), options.clone())));
    (bytes, seen)
}

/// So many processes that wait for tasks, but for the first.
fn group(count: usize) -> Arc<Root> {
    let mut communicator = threads::group(count).into_iter().map(|p| Arc::new(p) as Arc<dyn Communicator>);
    let first = communicator.next().unwrap();
    communicator.for_each(|peer| drop(std::thread::spawn(move || serve(&peer))));
    Root::new(first)
}

fn together(options: &Options, count: usize) -> (Vec<u8>, Vec<[u8; 3]>, Traffic) {
    let root = group(count);
    let make = |model: Model| SharedBackend::new(&root, model, None, options.clone());
    let session = Session::start(Setup::new(data(), options.clone()), make, &mut |_| {}).unwrap();
    let (bytes, seen, traffic) = trained(session);
    (bytes, seen, traffic.expect("several processes"))
}

/// Three processes keep the contract of a backend. The suite's clearcoat is none that a run stores, and so none that travels.
mod conformance {
    use super::{Options, SharedBackend, group};
    use refraxel_train::backend::conformance::{Suite, Tolerances};
    use refraxel_train::model::Model;

    fn three(model: Model) -> SharedBackend {
        SharedBackend::new(&group(3), model, None, Options::default())
    }

    refraxel_train::conformance_tests! {
        Suite { make: three, tolerances: Tolerances::SINGLE_PRECISION }, cfg(test) =>
            straight {
                rendering_agrees_with_the_reference,
                gradients_agree_with_the_reference,
                learning_lowers_the_loss,
                resampling_to_a_finer_grid_keeps_the_picture,
                peak_weights_mark_what_rays_see,
            }
            bent {
                bent_rendering_agrees_with_the_reference,
                sharp_rendering_agrees_with_the_reference,
                gradients_of_rays_alone_are_the_same,
            }
            mirrored {
                mirroring_agrees_with_the_reference,
                bodies_in_bodies_refract_and_mirror_as_the_reference_does,
            }
            absorbing {
                absorbing_bodies_look_as_the_reference_says,
                tinted_glass_is_learned_from_pictures,
            }
            contract {
                a_loaded_snapshot_of_straight_rays_goes_on_as_if_nothing_had_happened,
                a_parameter_that_is_not_a_number_is_reported,
                after_a_failure_nothing_changes_until_the_next_load,
                density_is_set_where_the_mask_says_and_its_moments_are_forgotten,
                baking_that_is_cancelled_changes_nothing,
                outcomes_come_in_order_and_once,
            }
    }
}

#[test]
fn messages_are_as_large_as_the_formula_says() {
    const RAYS: usize = 8192;
    let (batch, objective) = (scenes::batch(RAYS), scenes::objective());
    for count in [2, 3, 4] {
        let model = scenes::straight_model(1, Extent::Bounded);
        let mut backend = SharedBackend::new(&group(count), model, None, Options::default());
        step(&mut backend, &batch, &objective, 1);
        let (before, earlier) = (backend.snapshot().model.field.clone(), backend.traffic());
        let outcome = step(&mut backend, &batch, &objective, 2);
        let (after, later) = (&backend.snapshot().model.field, backend.traffic());
        let moved = (0..before.density.len()).filter(|&v| {
            let colour =
                |f: &VoxelField<f32>| f.colour[v * f.degree.stride()..][..f.degree.stride()].to_vec();
            before.density[v] != after.density[v] || colour(&before) != colour(after)
        });
        let (others, owners) = ((count - 1) as f64, (count - 1) as f64 / count as f64);
        let is_near = |found: u64, expected: f64, by: f64| (found as f64 / expected - 1.0).abs() < by;
        // Theory (4.19): of a ray 40 bytes, in whole chunks, of a voxel 4 (4 + 3b), of a sample 40 for each owner of voxels around it.
        let rays = owners * (40 * RAYS) as f64;
        assert!(is_near(later.rays - earlier.rays, rays, 0.05), "{count}: {rays} {earlier:?} {later:?}");
        let voxels = others * (4 * (4 + 3 * 4) * moved.count()) as f64;
        assert!(
            is_near(later.voxels - earlier.voxels, voxels, 0.01),
            "{count}: {voxels} {earlier:?} {later:?}"
        );
        let of_one_owner = owners * (40 * outcome.samples + 4 * 4 * RAYS as u64) as f64;
        let copies = (later.samples - earlier.samples) as f64 / of_one_owner;
        // Samples of which nothing depends leave nothing behind.
        assert!((0.8..1.5).contains(&copies), "{count}: {copies} {outcome:?}");
    }
}

#[test]
fn bent_rays_teach_processes_the_same_bits_as_one() {
    let options = options(&[("refraction.bend", "on"), ("search.enabled", "off"), ("judge.enabled", "off")]);
    let (bytes, seen) = alone(&options);
    let [two, three] = [2, 3].map(|count| {
        let (shared, pixels, traffic) = together(&options, count);
        assert!(shared == bytes, "{count} processes");
        assert_eq!(pixels, seen);
        traffic
    });
    // What goes to all goes to one other of two, to two others of three; of the rays a half or two thirds are sent.
    let ratio = |of: fn(&Traffic) -> u64| of(&three) as f64 / of(&two) as f64;
    assert!((ratio(|t| t.shared) - 2.0).abs() < 0.01, "{two:?} {three:?}");
    assert!((ratio(|t| t.voxels) - 2.0).abs() < 0.01, "{two:?} {three:?}");
    assert!((1.3..1.6).contains(&ratio(|t| t.rays)), "{two:?} {three:?}");
    assert!((1.2..1.6).contains(&ratio(|t| t.samples)), "{two:?} {three:?}");
}

#[test]
fn runs_that_mirror_and_whose_cameras_learn_have_the_same_bits() {
    let settings = [
        ("run.batch", "1024"), // a chunk for each process, and one more
        ("refraction.bend", "on"),
        ("search.enabled", "off"),
        ("judge.enabled", "off"),
        ("pose.enabled", "on"),
        // Bodies with a surface have an interpolation of their own.
        ("index.interpolation", "differences"),
    ];
    assert!(same_bits(&options(&settings)).bends_since.is_some());
}

#[test]
fn judged_runs_have_the_same_bits() {
    let state =
        same_bits(&options(&[("refraction.bend", "on"), ("run.steps", "180"), ("run.batch", "1024")]));
    assert!(state.verdict.is_some(), "{state:?}");
}

/// How a run ends that three processes train as one does.
fn same_bits(options: &Options) -> State {
    let (bytes, seen) = alone(options);
    let (shared, pixels, _) = together(options, 3);
    assert!(shared == bytes);
    assert_eq!(pixels, seen);
    Run::read(&bytes[..]).unwrap().state
}

#[test]
fn a_clearcoat_and_more_processes_than_chunks_change_no_bit() {
    let mut options = options(&[("run.batch", "300"), ("clearcoat.enabled", "on")]);
    options.refraction.bend = Switch::Off;
    let (bytes, seen) = alone(&options);
    let (shared, pixels, _) = together(&options, 5);
    assert!(shared == bytes);
    assert_eq!(pixels, seen);
}
