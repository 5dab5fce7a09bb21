//! What a library user may rely on: events, stops inside long phases, copies, and going on bit by bit.

use crate::bits::bytes;
use crate::scenes::{begun, events, options_with, written};
use refraxel_core::radiance::Pixel;
use refraxel_core::radiance::clearcoat::Clearcoat;
use refraxel_core::{BrickMap, Domain, Extent, Ray, vec3};
use refraxel_data::synth::{IndexTruth, SceneOptions, scene};
use refraxel_data::{Backdrop, Dataset, Part};
use refraxel_train::backend::{
    Batch, BatchGradient, BrickMask, Caches, Layers, Marching, Mirroring, Objective, RayGradient, Snapshot,
    StepOutcome,
};
use refraxel_train::cancel::{Cancel, Cancelled};
use refraxel_train::events::{Event, Task};
use refraxel_train::model::{Model, Optimiser, Reflection, Refraction};
use refraxel_train::options::Switch;
use refraxel_train::run::Run;
use refraxel_train::session::{IntoBackend, Session, SessionError, Setup, Stop, Until};
use refraxel_train::verdict::{Hypothesis, RegionVerdict, StayReason};
use refraxel_train::{Backend, CpuBackend, Options, TrainError};
use std::sync::OnceLock;
use tempfile::TempDir;

/// A small glass ball with masks.
fn glass_ball() -> Dataset {
    static DATA: OnceLock<(TempDir, Dataset)> = OnceLock::new();
    let (_, data) = DATA.get_or_init(|| written("glass_ball", 32, [24, 1, 2], |o| o.index_resolution = 16));
    data.clone()
}

fn options(bend: bool) -> Options {
    let mut options = options_with(&[
        ("run.steps", "40"),
        ("run.batch", "256"),
        ("grid.resolution", "32"),
        ("straight_steps", "10"),
        ("search.profile", "sharp"), // graded indices take as long as all else, and are searched in unit tests
    ]);
    options.refraction.bend = if bend { Switch::On } else { Switch::Off };
    // So short a run does not know whether its rays should bend.
    options.judge.straight = Switch::Off;
    options
}

fn start<M: IntoBackend>(bend: bool, make: impl FnOnce(Model) -> M) -> Session {
    Session::start(Setup::new(glass_ball(), options(bend)), make, &mut |_| {}).unwrap()
}

fn finish(session: &mut Session) -> Vec<Event> {
    let mut events = Vec::new();
    assert_eq!(session.run(Until::finished(), &mut |e| events.push(e)).unwrap(), Stop::Finished);
    events
}

/// A session that goes on where a saved run stands.
fn resumed(data: Dataset, options: Options, saved: &[u8]) -> Session {
    let run = Run::read(saved).unwrap();
    Session::resume(Setup::new(data, options), run, CpuBackend::resumed, &mut |_| {}).unwrap()
}

/// The run whose rays bend, without a pause: what happened, and its last bits.
fn bent() -> &'static (Vec<Event>, Vec<u8>) {
    static RUN: OnceLock<(Vec<Event>, Vec<u8>)> = OnceLock::new();
    RUN.get_or_init(|| {
        let mut session = start(true, CpuBackend::new);
        (finish(&mut session), bytes(&session))
    })
}

#[test]
fn a_run_tells_what_it_finds() {
    let (events, last) = bent();
    let has = |wanted: fn(&Event) -> bool| events.iter().any(wanted);
    assert!(has(|e| matches!(e, Event::RegionFound { region: 0, .. })));
    assert!(has(|e| matches!(e, Event::IndexSearched { likeness, .. } if likeness.is_finite())));
    assert!(has(|e| matches!(e, Event::Progress { task: Task::SearchingIndex, .. })));
    assert!(has(|e| matches!(e, Event::Stage { stage: 2, .. })));
    let records: Vec<_> =
        events.iter().filter_map(|e| if let Event::Record(r) = e { Some(r) } else { None }).collect();
    assert_eq!(records.iter().map(|r| r.step).collect::<Vec<_>>(), [25, 40]);
    assert!(records[0].events.iter().any(|e| matches!(e, Event::RaysBend { .. })), "the log keeps events");
    assert!(!records.iter().flat_map(|r| &r.events).any(|e| matches!(e, Event::Progress { .. })));
    assert_eq!(resumed(glass_ball(), options(true), last).progress(), 1.0);
}

#[test]
fn a_truth_of_bodies_in_bodies_is_held_and_stored() {
    let hollow = scene("hollow_ball", &SceneOptions::default()).unwrap();
    let index = Some(IndexTruth::of_scene(&hollow).unwrap().into());
    let mut options = options(true);
    (options.surface.rate, options.index.rate) = (0.0, 0.0);
    let setup = Setup { index, ..Setup::new(glass_ball(), options) };
    let mut session = begun(setup);
    let events = finish(&mut session);
    assert_eq!(events.iter().filter(|e| matches!(e, Event::RegionFound { .. })).count(), 2);
    let Refraction { medium, states, .. } = Run::read(&bytes(&session)[..]).unwrap().model.refraction;
    let indices: Vec<f32> = medium.regions().iter().map(|r| r.interior_index().unwrap()).collect();
    assert_eq!(indices, [1.5, 1.0]);
    let held: Vec<bool> = states.iter().map(|s| s.fixed_index).collect();
    assert_eq!(held, [false, true], "the checkpoint knows that air stays air");
    let middle = vec3(0.02, -0.03, -0.13);
    let found = [middle, middle + vec3(0.0, 0.45, 0.0)].map(|x| medium.index(x));
    assert!((found[0] - 1.0).abs() < 1e-6 && (found[1] - 1.5).abs() < 1e-6, "{found:?}");
}

/// A small scene with masks, and the folder in which it lies.
fn scene_data(name: &str, size: u32, ior: Option<f64>) -> (TempDir, Dataset) {
    written(name, size, [30, 1, 2], |o| (o.spp, o.ior) = (4, ior))
}

/// A run that is long enough for a race, or its beginning.
fn judged(data: Dataset, until: Until, change: fn(&mut Options)) -> (Session, Vec<Event>) {
    let mut options = options(true);
    (options.run.steps, options.run.batch) = (200, 512);
    options.judge.straight = Switch::On;
    change(&mut options);
    let mut session = begun(Setup::new(data, options));
    let events = events(&mut session, until);
    (session, events)
}

#[test]
fn glass_that_hardly_bends_is_judged_straight_unless_rays_must_bend() {
    let (_folder, data) = scene_data("glass_ball", 40, Some(1.01));
    let (session, events) = judged(data.clone(), Until::finished(), |_| {});
    let verdict = session.state().verdict.as_ref().unwrap();
    assert_eq!((verdict.regions[0].hypothesis, verdict.views), (Hypothesis::Straight, 5), "15 % of 30 views");
    assert!(session.state().stays_straight && session.backend().medium().is_none());
    assert!(events.iter().any(|e| matches!(e, Event::RaysStayStraight { why: StayReason::Judged })));
    let after = events.iter().skip_while(|e| !matches!(e, Event::Judged { .. }));
    let stages: Vec<u32> =
        after.filter_map(|e| if let Event::Stage { stage, .. } = e { Some(*stage) } else { None }).collect();
    assert_eq!(stages, [0, 1, 2], "straight rays learn what is inside from coarse to fine");
    let stored = Run::read(&bytes(&session)[..]).unwrap();
    assert_eq!(stored.state.verdict.as_ref(), Some(verdict), "the checkpoint keeps the verdict");
    let (forced, _) = judged(data, Until::step(20), |o| o.judge.straight = Switch::Off);
    assert!(!forced.backend().medium().is_none());
}

/// A seed with which scenes of 64² pixels are decided on after 100,000 rays, as with the two after it. With seed 0 they stay undecided.
const LUCK: u64 = 1;

#[test]
fn glass_that_bends_is_judged_so() {
    let (_folder, data) = scene_data("glass_ball", 64, None);
    // Long enough to know what is seen through the glass.
    let mut options = options(true);
    (options.run.steps, options.run.batch, options.refraction.straight_steps) = (400, 1024, 100);
    options.judge.straight = Switch::On;
    options.run.seed = LUCK;
    let mut ball = begun(Setup::new(data.clone(), options.clone()));
    ball.run(Until::step(150), &mut |_| {}).unwrap();
    let verdict = &ball.state().verdict.as_ref().unwrap().regions[0];
    let is_shown = verdict.evidence.is_some_and(|e| e.above.significance() > 3.0 && e.above.mean > 0.05);
    let is_won = verdict.gain_inside > verdict.margin;
    assert!(verdict.hypothesis != Hypothesis::Straight && (is_shown || is_won), "{verdict:?}");

    let mut unlucky = ball.snapshot();
    let events = finish(&mut ball);
    let proof = ball.state().verdict.as_ref().unwrap().proof.unwrap();
    assert!(proof.inside.unwrap() > 0.0 && proof.outside.unwrap() > 0.0, "{proof:?}");
    assert!(events.iter().any(|e| matches!(e, Event::Proven { proof: p } if *p == proof)));
    assert!((0.5..0.7).contains(&proof.progress) && !ball.backend().medium().is_none(), "{proof:?}");

    // Where straight rays had been better, there is a way back, also after a pause.
    let baseline = unlucky.state.baseline.as_mut().unwrap();
    baseline.outside.iter_mut().flatten().for_each(|e| *e *= 1e-3);
    let setup = Setup::new(data, options);
    let mut back = Session::resume(setup, unlucky, CpuBackend::resumed, &mut |_| {}).unwrap();
    let events = finish(&mut back);
    assert!(events.iter().any(|e| matches!(e, Event::RaysStayStraight { why: StayReason::FellBehind })));
    assert!(back.backend().medium().is_none() && back.state().stays_straight);
    assert!(!back.state().verdict.as_ref().unwrap().bends() && back.state().baseline.is_none());
    let scores = back.evaluate(Part::Test, &mut |_| {}, &mut |_, _| {}).unwrap().scores;
    assert!(scores.psnr.unwrap() > 15.0, "straight rays have learned the rest of the run: {scores:?}");
}

#[test]
fn bodies_of_different_index_are_found_judged_and_learned_each_by_itself() {
    let (_folder, data) = scene_data("two_indices", 64, None);
    let (run, events) = judged(data, Until::step(110), |o| {
        (o.run.steps, o.run.batch, o.refraction.straight_steps) = (400, 1024, 100);
        o.run.seed = LUCK;
    });
    let found = events.iter().filter(|e| matches!(e, Event::RegionFound { .. })).count();
    let verdicts = &run.state().verdict.as_ref().unwrap().regions;
    assert!(found >= 2 && verdicts.len() == found, "{found} regions: {verdicts:?}");
    let bent = verdicts.iter().filter(|v| v.hypothesis != Hypothesis::Straight).count();
    let medium = &run.backend().medium().medium;
    assert_eq!(medium.regions().len(), bent, "a region that lost is straight, and no other");
    let is_judged = |v: &RegionVerdict| v.contestants.len() > 1 || v.evidence.is_some();
    assert!(bent > 0 && verdicts.iter().all(is_judged), "{verdicts:?}");
}

#[test]
fn photographs_of_surroundings_bend_rays_in_a_contracted_space() {
    let mut data = glass_ball();
    data.backdrop = Backdrop::Surroundings;
    let setup = Setup::new(data, options(true));
    let mut session = begun(setup);
    let events = finish(&mut session);
    assert_eq!(session.backend().domain().extent, Extent::Contracted);
    assert!(events.iter().any(|e| matches!(e, Event::RaysBend { .. })));
    assert!(!session.backend().medium().is_none());
    let found = session.evaluate(Part::Test, &mut |_| {}, &mut |_, _| {}).unwrap();
    assert!(found.scores.psnr.unwrap() > 10.0, "{:?}", found.scores);
}

#[test]
fn a_camera_in_the_glass_sees_the_scene_around() {
    let session = resumed(glass_ball(), options(true), &bent().1);
    let mut camera = session.data().views[0].camera;
    camera.world_from_camera.translation = vec3(0.02, -0.03, -0.13);
    let index = session.backend().medium().medium.index(camera.world_from_camera.translation.cast());
    assert!(index > 1.1, "the camera is in the glass: {index}");
    let view = session.render(&camera).unwrap();
    let lit = view.colour.iter().filter(|c| c.iter().any(|v| *v > 5)).count();
    assert!(lit > view.colour.len() / 2, "{lit} of {} pixels show something", view.colour.len());
}

#[test]
fn nothing_is_pruned_before_rays_look_inside() {
    let voxels = |bend: bool| {
        let mut options = options(bend);
        (options.run.steps, options.refraction.straight_steps, options.grid.stages) = (200, 100, 3);
        (options.grid.resolution, options.grid.prune_weight) = (96, 0.05);
        let setup = Setup::new(glass_ball(), options);
        let mut session = begun(setup);
        let mut stages = 0;
        let count = &mut |e| stages += usize::from(matches!(e, Event::Stage { .. }));
        assert_eq!(session.run(Until::step(40), count).unwrap(), Stop::Reached);
        assert_eq!(
            (stages, session.backend().medium().is_none()),
            (1, true),
            "the grid is finer, all rays straight"
        );
        let map = session.backend().map();
        (map.bricks().len(), BrickMap::dense(map.resolution()).bricks().len())
    };
    let (kept, all) = voxels(true);
    assert_eq!(kept, all);
    let (kept, all) = voxels(false);
    assert!(kept < all, "straight rays prune: {kept} of {all} bricks");
}

#[test]
fn a_box_without_masks_stays_straight_and_says_so() {
    let (_folder, data) = scene_data("opaque", 40, None);
    let (session, events) = judged(data, Until::finished(), |o| {
        o.set("refraction.bounds", "-0.5,-0.5,-0.5,0.5,0.5,0.5").unwrap();
    });
    assert!(events.iter().any(|e| matches!(e, Event::RaysStayStraight { why: StayReason::OnlyABox })));
    assert!(session.backend().medium().is_none());
}

/// Cancels at the first event that is `wanted`, saves, and opens again what was saved.
fn stopped_and_resumed(mut session: Session, wanted: fn(&Event) -> bool) -> Session {
    let handle = session.handle();
    let mut seen = false;
    let stop = session.run(Until::finished(), &mut |event| {
        if !seen && wanted(&event) {
            seen = true;
            handle.cancel();
        }
    });
    assert_eq!(stop.unwrap(), Stop::Cancelled);
    let mut saved = Vec::new();
    session.write(&mut saved).unwrap();
    resumed(glass_ball(), options(true), &saved)
}

#[test]
fn a_run_that_is_stopped_anywhere_and_resumed_ends_with_the_same_bits() {
    // In the order in which they come.
    let places: [fn(&Event) -> bool; 6] = [
        |e| matches!(e, Event::Progress { task: Task::FindingOccluders, done: 3, .. }),
        |e| matches!(e, Event::Progress { task: Task::Carving, done: 1, .. }),
        |e| matches!(e, Event::Progress { task: Task::SearchingIndex, done: 7, .. }),
        |e| matches!(e, Event::Progress { task: Task::Baking, .. }),
        |e| matches!(e, Event::Progress { task: Task::Pruning, .. }),
        |e| matches!(e, Event::Record(r) if r.step == 25),
    ];
    let mut session = places.into_iter().fold(start(true, CpuBackend::new), stopped_and_resumed);
    finish(&mut session);
    assert!(bytes(&session) == bent().1);
}

/// A run with a guessed index, saved after some of its last 22 steps: from each of these it goes on to the bits of the next, and of its
/// end.
fn goes_on_bit_by_bit(steps: u64, settings: &[(&str, &str)]) -> Session {
    let mut options = options(true);
    options.run.steps = steps;
    let usual = [("search.enabled", "off"), ("judge.enabled", "off")];
    usual.iter().chain(settings).for_each(|(key, value)| options.set(key, value).unwrap());
    let mut whole = begun(Setup::new(glass_ball(), options.clone()));
    let mut save = |step: u64| {
        whole.run(Until::step(step), &mut |_| {}).unwrap();
        bytes(&whole)
    };
    let saved = [22, 18, 13, 8, 1, 0].map(|left| (steps - left, save(steps - left)));
    for [(from, before), (to, after)] in saved.array_windows() {
        let mut session = resumed(glass_ball(), options.clone(), before);
        session.run(Until::step(*to), &mut |_| {}).unwrap();
        assert!(bytes(&session) == *after, "from step {from} to step {to}");
    }
    whole
}

#[test]
fn sharp_smooth_and_graded_bodies_go_on_bit_by_bit_from_any_step() {
    for profile in ["sharp", "smooth", "graded"] {
        let session = goes_on_bit_by_bit(30, &[("search.profile", profile)]);
        assert_eq!(session.backend().mirroring().regions, 1, "what is mirrored goes on, too");
    }
}

#[test]
fn a_prism_is_a_polyhedron_whose_planes_learn_and_are_resumed() {
    // Of 60 views, every other run finds a face too many.
    let (_folder, data) = written("prism", 140, [100, 0, 3], |o| o.spp = 4);
    let mut options = options_with(&[
        ("run.steps", "600"),
        ("run.batch", "1024"),
        ("grid.resolution", "72"),
        ("straight_steps", "50"),
        ("search.enabled", "off"),
        ("judge.enabled", "off"),
    ]);
    options.refraction.bend = Switch::On;
    let solid = |session: &Session| session.backend().medium().states[0].solid.clone().unwrap();
    let mut whole = begun(Setup::new(data.clone(), options.clone()));
    let events = events(&mut whole, Until::step(60));
    assert!(events.iter().any(|e| matches!(e, Event::RegionFound { faces: Some(4), .. })), "{events:?}");
    let (before, saved) = (solid(&whole), bytes(&whole));
    whole.run(Until::step(75), &mut |_| {}).unwrap();
    let after = solid(&whole);
    assert_eq!(before.faces.len(), 4, "{before:?}");
    assert!(before.faces != after.faces && before.base == after.base, "{after:?}");
    let mut again = resumed(data, options, &saved);
    again.run(Until::step(75), &mut |_| {}).unwrap();
    assert!(bytes(&again) == bytes(&whole));
}

#[test]
fn poses_and_exposures_that_learn_go_on_bit_by_bit_from_any_step() {
    // They begin at step 48.
    let exposures = [("exposure.enabled", "on")];
    goes_on_bit_by_bit(66, &exposures);
    goes_on_bit_by_bit(66, &[&exposures[..], &[("pose.enabled", "on")]].concat());
    goes_on_bit_by_bit(66, &[("pose.enabled", "on"), ("pose.lens", "on")]);
}

#[test]
fn another_thread_gets_a_copy_while_the_run_goes_on() {
    let mut session = start(false, CpuBackend::new);
    let copy = session.handle().snapshot();
    session.run(Until::step(20), &mut |_| {}).unwrap();
    let copy = copy.recv().unwrap();
    assert!(copy.state.step < 20);
    // The copy is a run of its own.
    let setup = Setup::new(glass_ball(), options(false));
    let mut fork = Session::resume(setup, copy, CpuBackend::resumed, &mut |_| {}).unwrap();
    fork.run(Until::step(20), &mut |_| {}).unwrap();
    assert!(bytes(&fork) == bytes(&session));
    let late = session.handle().snapshot();
    drop(session);
    assert!(late.recv().is_err(), "a session that is gone has nothing to give");
}

#[test]
fn a_copy_of_a_run_with_a_clock_knows_the_time_that_is_left() {
    let mut clocked = options(false);
    clocked.set("run.minutes", "0.03").unwrap();
    let setup = Setup::new(glass_ball(), clocked.clone());
    let mut session = begun(setup);
    let copy = session.handle().snapshot();
    session.run(Until::finished(), &mut |_| {}).unwrap();
    let copy = copy.recv().unwrap();
    assert!(copy.state.seconds < 1.0 && session.state().seconds >= 1.8, "{}", session.state().seconds);
    let mut fork =
        Session::resume(Setup::new(glass_ball(), clocked), copy, CpuBackend::resumed, &mut |_| {}).unwrap();
    assert_eq!(fork.run(Until::finished(), &mut |_| {}).unwrap(), Stop::Finished);
    assert!(fork.state().seconds >= 1.8);
}

#[test]
fn a_finished_run_is_stored_in_half_precision_as_it_renders() {
    let mut session = start(false, CpuBackend::new);
    session.run(Until::step(39), &mut |_| {}).unwrap();
    let (voxels, full) = (session.backend().map().voxels(), bytes(&session).len());
    finish(&mut session);
    let saved = bytes(&session);
    // Degree 2 has 27 coefficients: four bytes each before the end, two bytes each after it.
    let saving = full as i64 - saved.len() as i64;
    assert!((saving - 54 * voxels as i64).abs() < 200, "{saving} bytes for {voxels} voxels");
    let back = Run::read(&saved[..]).unwrap();
    assert!(back.model.field.colour == session.backend().snapshot().model.field.colour);
    // It can still be made longer.
    let mut longer = options(false);
    longer.run.steps = 60;
    let mut resumed = resumed(glass_ball(), longer, &saved);
    finish(&mut resumed);
    assert_eq!(resumed.state().step, 60);
}

#[test]
fn a_session_renders_and_scores_what_it_holds() {
    let mut session = start(false, CpuBackend::new);
    finish(&mut session);
    let mut views = 0;
    let found = session.evaluate(Part::Test, &mut |_| {}, &mut |_, _| views += 1).unwrap();
    assert_eq!((found.scores.images, views), (2, 2));
    assert!(found.scores.psnr.unwrap() > 15.0 && found.index.is_some());
    let view = session.render(&session.data().views[0].camera).unwrap();
    assert_eq!((view.width, view.colour.len()), (32, 32 * 32));
}

#[test]
fn a_wish_to_stop_ends_a_rendering_and_an_evaluation_and_is_fulfilled_then() {
    let session = start(false, CpuBackend::new);
    let camera = session.data().views[0].camera;
    session.handle().cancel();
    assert!(session.render(&camera).is_err() && session.render(&camera).is_ok());
    session.handle().cancel();
    assert!(session.evaluate(Part::Test, &mut |_| {}, &mut |_, _| panic!("a view")).is_err());
    assert!(session.evaluate(Part::Test, &mut |_| {}, &mut |_, _| {}).is_ok());
}

#[test]
fn what_cannot_lead_to_a_result_is_refused_before_any_work() {
    let refused = |change: fn(&mut Setup)| {
        let mut setup = Setup::new(glass_ball(), options(true));
        change(&mut setup);
        Session::start(setup, CpuBackend::new, &mut |_| panic!("work")).err().unwrap().to_string()
    };
    assert!(refused(|s| s.data.split.train.clear()).contains("no training images"));
    assert!(refused(|s| s.options.surface.blur = 99.0).contains("`surface.blur`"));
    assert!(refused(|s| _ = s.options.set("shape.start", "file")).contains("--index-from"));
    let setup = Setup::new(glass_ball(), options(true));
    let mut run = start(true, CpuBackend::new).snapshot();
    run.source.train.pop();
    let other = Session::resume(setup, run, CpuBackend::resumed, &mut |_| {}).err();
    assert!(matches!(other, Some(SessionError::OtherViews { was: 23, found: 24, .. })));
    let mut moved = Setup::new(glass_ball(), options(true));
    let first = moved.data.split.train[0];
    moved.data.views[first].camera.focal[0] += 1e-6;
    let run = start(true, CpuBackend::new).snapshot();
    let other = Session::resume(moved, run, CpuBackend::resumed, &mut |_| {}).err();
    assert!(matches!(other, Some(SessionError::OtherPhotographs)));
}

#[test]
fn masks_that_lead_nowhere_leave_a_straight_run_that_can_be_resumed() {
    let mut setup = Setup::new(glass_ball(), options(true));
    // A place that no silhouette shows.
    setup.data.stated_box = Some(refraxel_core::Aabb::new(vec3(0.7, 0.7, 0.7), vec3(0.9, 0.9, 0.9)));
    let data = setup.data.clone();
    let mut session = begun(setup);
    let events = events(&mut session, Until::step(20));
    assert!(events.iter().any(|e| matches!(e, Event::RaysStayStraight { .. })));
    assert!(session.options().refraction.bend.is_on() && session.state().stays_straight);
    let run = session.snapshot();
    let mut resumed =
        Session::resume(Setup::new(data, options(true)), run, CpuBackend::resumed, &mut |_| {}).unwrap();
    finish(&mut session);
    finish(&mut resumed);
    assert!(bytes(&resumed) == bytes(&session));
}

/// A backend whose outcomes become known some steps late, and some of whose steps overflow and leave a parameter that is no number.
struct Late {
    cpu: CpuBackend,
    waiting: Vec<StepOutcome>,
    lag: usize,
    overflows: &'static [u64],
    failed: bool,
}

impl Late {
    fn new(lag: usize, overflows: &'static [u64]) -> impl FnOnce(Model) -> Self {
        move |model| Self { cpu: CpuBackend::new(model), waiting: Vec::new(), lag, overflows, failed: false }
    }
}

impl Backend for Late {
    fn load(&mut self, model: Model, optimiser: Option<Optimiser>) {
        self.waiting.clear();
        self.failed = false;
        self.cpu.load(model, optimiser);
    }
    fn submit(&mut self, batch: &Batch, objective: &Objective, step: u64) {
        if self.failed {
            return;
        }
        self.failed = self.overflows.contains(&step);
        let mut batch = batch.clone();
        if self.failed {
            batch.target[0] = [f32::INFINITY; 3];
        }
        self.cpu.submit(&batch, objective, step);
        if self.failed {
            self.cpu.edit(|model| model.field.density.fill(f32::NAN));
        }
        self.waiting.extend(self.cpu.outcomes(true));
    }
    fn outcomes(&mut self, wait: bool) -> Vec<StepOutcome> {
        let known = if wait { self.waiting.len() } else { self.waiting.len().saturating_sub(self.lag) };
        self.waiting.drain(..known).collect()
    }
    fn snapshot(&self) -> Snapshot<'_> {
        self.cpu.snapshot()
    }
    fn domain(&self) -> &Domain<f32> {
        self.cpu.domain()
    }
    fn map(&self) -> &BrickMap {
        self.cpu.map()
    }
    fn medium(&self) -> &Refraction {
        self.cpu.medium()
    }
    fn mirroring(&self) -> Mirroring {
        self.cpu.mirroring()
    }
    fn set_medium(&mut self, medium: Refraction) {
        self.cpu.set_medium(medium);
    }
    fn set_reflection(&mut self, reflection: Reflection) {
        self.cpu.set_reflection(reflection);
    }
    fn set_clearcoat(&mut self, clearcoat: Clearcoat<f32>) {
        self.cpu.set_clearcoat(clearcoat);
    }
    fn set_density(&mut self, value: f32, inside: &BrickMask) {
        self.cpu.set_density(value, inside);
    }
    fn resample(&mut self, domain: Domain<f32>, map: BrickMap) {
        self.cpu.resample(domain, map);
    }
    fn refresh_occupancy(&mut self, marching: &Marching) {
        self.cpu.refresh_occupancy(marching);
    }
    fn bake(&mut self, caches: Caches, marching: &Marching, cancel: &Cancel) -> Result<(), Cancelled> {
        self.cpu.bake(caches, marching, cancel)
    }
    fn render(&self, rays: &[Ray<f32>], marching: &Marching, layers: Layers) -> Vec<Pixel<f32>> {
        self.cpu.render(rays, marching, layers)
    }
    fn gradient(&self, batch: &Batch, objective: &Objective) -> BatchGradient {
        self.cpu.gradient(batch, objective)
    }
    fn ray_gradients(&self, batch: &Batch, objective: &Objective) -> Vec<RayGradient> {
        self.cpu.ray_gradients(batch, objective)
    }
    fn peak_weights(
        &self,
        rays: &[Ray<f32>],
        marching: &Marching,
        cancel: &Cancel,
    ) -> Result<Vec<f32>, Cancelled> {
        self.cpu.peak_weights(rays, marching, cancel)
    }
}

#[test]
fn outcomes_that_lag_change_nothing_of_a_run() {
    let (punctual_events, punctual) = bent();
    let mut late = start(true, Late::new(5, &[]));
    let late_events = finish(&mut late);
    assert!(bytes(&late) == *punctual);
    let psnr = |events: &[Event]| -> Vec<f64> {
        events
            .iter()
            .filter_map(|e| if let Event::Record(r) = e { Some(r.train_psnr) } else { None })
            .collect()
    };
    assert_eq!(psnr(punctual_events), psnr(&late_events));
}

#[test]
fn an_overflow_returns_to_the_last_good_state_with_lower_rates() {
    for lag in [0, 3] {
        let mut session = start(false, Late::new(lag, &[17]));
        let events = finish(&mut session);
        let back = events.iter().find(|e| matches!(e, Event::RolledBack { .. }));
        assert_eq!(back, Some(&Event::RolledBack { step: 17, rate_scale: 0.5 }), "lag {lag}");
        assert_eq!((session.state().rate_scale, session.state().step), (0.5, 40));
    }
}

#[test]
fn no_stop_comes_before_the_outcomes_of_its_steps() {
    let mut session = start(false, Late::new(5, &[17]));
    let mut events = Vec::new();
    session.run(Until::step(18), &mut |e| events.push(e)).unwrap();
    assert!(events.contains(&Event::RolledBack { step: 17, rate_scale: 0.5 }));
    let state = session.state();
    assert_eq!((state.rate_scale, state.step), (0.5, 18));
    assert!(session.snapshot().model.field.density.iter().all(|d| d.is_finite()));
}

#[test]
fn a_run_that_overflows_again_and_again_gives_up() {
    let overflows = &[20, 21, 22, 23, 24, 25, 26];
    let mut session = start(false, Late::new(0, overflows));
    let error = session.run(Until::finished(), &mut |_| {}).unwrap_err();
    assert!(matches!(error, SessionError::Train(TrainError::Diverged { step: 24, rollbacks: 4 })), "{error}");
    // Who saves it nevertheless saves the last good state.
    assert!(session.snapshot().model.field.density.iter().all(|d| d.is_finite()));
    let again = Run::read(&bytes(&session)[..]).unwrap();
    assert_eq!(again.state.step, session.state().step);
}
