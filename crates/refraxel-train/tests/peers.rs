//! Processes that train one model together: the same bits as one, and messages of the size that was foreseen.

use refraxel_core::{Camera, vec3};
use refraxel_data::synth::{SynthOptions, ViewCounts, synthesize};
use refraxel_data::{Dataset, OpenOptions};
use refraxel_train::cpu::{Lead, SharedBackend, help};
use refraxel_train::model::Model;
use refraxel_train::options::Switch;
use refraxel_train::peers::{Peers, Traffic, threads};
use refraxel_train::session::{Session, Setup, Until};
use refraxel_train::{Backend, CpuBackend, Options};
use std::ops::ControlFlow;
use std::sync::{Arc, OnceLock};

/// A small scene with masks.
fn data() -> Dataset {
    static DATA: OnceLock<(tempfile::TempDir, Dataset)> = OnceLock::new();
    let (_, data) = DATA.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let options = SynthOptions {
            size: 32,
            views: ViewCounts { train: 16, val: 1, test: 2 },
            spp: 1,
            detail_spp: 0,
            index_resolution: 16,
            ..SynthOptions::new("glass_ball", folder.path())
        };
        synthesize(&options, &|_| ControlFlow::Continue(())).unwrap();
        (folder, Dataset::open(options.out, &OpenOptions::default()).unwrap())
    });
    data.clone()
}

fn options(settings: &[(&str, &str)]) -> Options {
    let mut options = Options::default();
    let usual =
        [("run.steps", "60"), ("run.batch", "2048"), ("grid.resolution", "32"), ("straight_steps", "20")];
    usual.iter().chain(settings).for_each(|(key, value)| _ = options.set(key, value).unwrap());
    options
}

/// A run to its end: what it has learned, and what a camera sees.
fn trained<B: Tells>(mut session: Session<B>) -> (Vec<u8>, Vec<[u8; 3]>, B::Told) {
    session.run(Until::finished(), &mut |_| {}).unwrap();
    let eye = Camera::look_at(vec3(3.0, 1.0, 2.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), 0.7, [40, 30]);
    let colours = session.render(&eye).unwrap().colour;
    let mut run = session.snapshot();
    run.state.seconds = 0.0;
    let mut bytes = Vec::new();
    run.view().write(&mut bytes).unwrap();
    (bytes, colours, session.backend().told())
}

/// What a backend tells of its messages.
trait Tells: Backend {
    type Told;
    fn told(&self) -> Self::Told;
}

impl Tells for CpuBackend {
    type Told = ();
    fn told(&self) {}
}

impl Tells for SharedBackend {
    type Told = Traffic;
    fn told(&self) -> Traffic {
        self.traffic()
    }
}

fn alone(options: &Options) -> (Vec<u8>, Vec<[u8; 3]>) {
    let session = Session::start(Setup::new(data(), options.clone()), CpuBackend::new, &mut |_| {}).unwrap();
    let (bytes, seen, ()) = trained(session);
    (bytes, seen)
}

fn together(options: &Options, count: usize) -> (Vec<u8>, Vec<[u8; 3]>, Traffic) {
    let mut peers = threads::group(count).into_iter().map(|p| Arc::new(p) as Arc<dyn Peers>);
    let first = peers.next().unwrap();
    std::thread::scope(|scope| {
        for peer in peers {
            scope.spawn(move || help(&peer));
        }
        let lead = Lead::new(first);
        let make = |model: Model| SharedBackend::new(&lead, model, None, options.clone());
        trained(Session::start(Setup::new(data(), options.clone()), make, &mut |_| {}).unwrap())
    })
}

#[test]
fn bent_rays_teach_processes_the_same_bits_as_one() {
    let options = options(&[("refraction.bend", "on"), ("judge.straight", "off")]);
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
fn judged_runs_whose_cameras_learn_have_the_same_bits() {
    let settings = [
        ("refraction.bend", "on"),
        ("reflection.cache", "baked"),
        ("reflection.bake_period", "15"),
        ("pose.enabled", "on"),
        ("pose.first", "8"),
        ("pose.rays", "512"),
    ];
    let options = options(&settings);
    let (bytes, seen) = alone(&options);
    let (shared, pixels, _) = together(&options, 2);
    assert!(shared == bytes);
    assert_eq!(pixels, seen);
}

#[test]
fn a_clearcoat_and_more_processes_than_chunks_change_no_bit() {
    let mut options =
        options(&[("run.batch", "300"), ("clearcoat.enabled", "on"), ("clearcoat.probes", "4")]);
    options.refraction.bend = Switch::Off;
    let (bytes, seen) = alone(&options);
    let (shared, pixels, _) = together(&options, 5);
    assert!(shared == bytes);
    assert_eq!(pixels, seen);
}
