//! Saving a run, with a fault at each of its requests to the system.

use super::*;
use crate::alignment::Alignment;
use crate::checkpoint::{Fault, with_fault};
use crate::model::Optimiser;
use crate::options::Options;
use crate::plan::Plan;
use refraxel_core::{Aabb, Domain, Extent, Vec3};
use refraxel_data::atomic::remove_leftovers;
use refraxel_data::{Backdrop, LocalOrigin};
use std::path::Path;
use std::process::Command;

/// A run of so many steps, larger than the buffer of a write.
fn run(step: u64) -> Run {
    let mut options = Options::default();
    options.grid.stages = 1;
    let cube = Aabb::cube(1.0);
    let finest = Domain::with_longest(cube, Extent::Bounded, 24);
    let origin = LocalOrigin::at(Vec3::new(471_000.0, 5_270_000.0, 0.0625 * step as f64));
    let plan = Plan { finest, near: 0.1, origin, backdrop: Backdrop::Color([1.0; 3]) };
    let model = plan.start(&options);
    let optimiser = Optimiser::new(&model);
    let (state, source) = (State { step, ..State::default() }, Source::default());
    Run { options, plan, state, source, model, optimiser, detected: None, alignment: Alignment::default() }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

/// Requests to the system in a save: create, some writes, flush, rename, flush of the folder.
fn requests(of: &Run) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let (saved, requests) = with_fault(Fault::Full, usize::MAX, || of.view().save(folder.path()));
    saved.unwrap();
    assert!(requests > 5, "{requests}");
    requests
}

#[test]
fn a_save_that_fails_anywhere_leaves_a_whole_checkpoint_and_nothing_else() {
    let (earlier, later) = (run(1), run(2));
    let requests = requests(&later);
    for at in 0..requests {
        let folder = tempfile::tempdir().unwrap();
        let save = || with_fault(Fault::Full, at, || later.view().save(folder.path())).0;
        // Only the folder is flushed after the new file has its name.
        let is_there = at + 1 == requests;
        let error = save().unwrap_err().to_string();
        assert!(error.contains(CHECKPOINT), "{error}");
        assert_eq!(names(folder.path()).len(), usize::from(is_there), "first save, request {at}");
        earlier.view().save(folder.path()).unwrap();
        let error = save().unwrap_err().to_string();
        assert_eq!(error.contains("is unchanged"), !is_there, "{error}");
        let step = Run::load(folder.path()).unwrap().state.step;
        assert_eq!(step, if is_there { 2 } else { 1 }, "request {at}");
        assert_eq!(names(folder.path()), [CHECKPOINT], "request {at}");
    }
}

#[test]
fn a_run_to_render_is_the_saved_one_without_moments_of_voxels() {
    let folder = tempfile::tempdir().unwrap();
    let mut saved = run(7);
    saved.optimiser.density.fill(0.5);
    saved.optimiser.colour.fill(0.25);
    saved.view().save(folder.path()).unwrap();
    let (whole, shown) = (Run::load(folder.path()).unwrap(), Run::load_to_render(folder.path()).unwrap());
    assert!(whole.optimiser.density.iter().all(|m| *m == 0.5));
    assert!(shown.optimiser.density.iter().chain(shown.optimiser.colour.iter()).all(|m| *m == 0.0));
    assert!(shown.optimiser.fits(&shown.model) && shown.optimiser.occupied == whole.optimiser.occupied);
    assert!(
        shown.model.field.density == whole.model.field.density
            && shown.model.field.colour == whole.model.field.colour
    );
    let (source, origin) = Run::source_of(folder.path()).unwrap();
    assert_eq!((source, origin), (whole.source, whole.plan.origin));
}

#[test]
fn masks_that_are_moved_further_than_a_run_moves_them_are_refused() {
    let read = |mask_shift: f32| {
        let folder = tempfile::tempdir().unwrap();
        let mut run = run(1);
        run.state.mask_shift = mask_shift;
        run.view().save(folder.path()).unwrap();
        Run::load(folder.path()).map(|run| run.state.mask_shift).map_err(|e| e.to_string())
    };
    assert_eq!(read(-2.5), Ok(-2.5));
    for far in [6.5, -1e30] {
        let error = read(far).unwrap_err();
        assert!(error.contains("it moves masks by"), "{error}");
    }
}

/// In the environment of a child: the folder to save in, and the request at which to die.
const CHILD: [&str; 2] = ["REFRAXEL_TEST_FOLDER", "REFRAXEL_TEST_DEATH"];

/// A program that gets no memory ends as one that is killed.
#[test]
fn a_program_that_dies_anywhere_in_a_save_leaves_a_whole_checkpoint_and_what_the_next_start_removes() {
    let (earlier, later) = (run(1), run(2));
    if let [Some(folder), Some(at)] = CHILD.map(std::env::var_os) {
        let at = at.to_str().and_then(|at| at.parse().ok()).unwrap();
        let _ = with_fault(Fault::Death, at, || later.view().save(Path::new(&folder)));
        return;
    }
    let this = "run::tests::\
                a_program_that_dies_anywhere_in_a_save_leaves_a_whole_checkpoint_and_what_the_next_start_removes";
    let requests = requests(&later);
    for at in 0..requests {
        let folder = tempfile::tempdir().unwrap();
        earlier.view().save(folder.path()).unwrap();
        let mut child = Command::new(std::env::current_exe().unwrap());
        let child = child.args(["--exact", this]).env(CHILD[0], folder.path()).env(CHILD[1], at.to_string());
        assert!(!child.output().unwrap().status.success(), "request {at}: the child lives");
        let step = Run::load(folder.path()).unwrap().state.step;
        assert_eq!(step, if at + 1 == requests { 2 } else { 1 }, "request {at}");
        let is_beside = at > 0 && at + 1 < requests;
        let removed = remove_leftovers(folder.path(), |_| true).unwrap();
        assert_eq!(removed, usize::from(is_beside), "request {at}");
        assert_eq!(names(folder.path()), [CHECKPOINT], "request {at}");
        later.view().save(folder.path()).unwrap();
    }
}
