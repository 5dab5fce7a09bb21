//! Carries a plan out: the photographs, their poses, and the dataset that is made of them.

use super::calls::{PYCOLMAP, PYCOLMAP_FILE, Shared, Stage, TOO_LITTLE};
use super::frames::Frames;
use super::photos::FEWEST;
use super::plan::Plan;
use super::report::{Made, Report};
use super::source::Source;
use super::stage::{self, Done};
use super::work::{self, WorkFolder};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show, clock};
use crate::verbs::dataset::data_failure;
use crate::verbs::files::create_folder;
use crate::verbs::interrupts::interrupted;
use anyhow::Context;
use refraxel_data::{ColmapModel, Dataset, MaskMeaning, OpenOptions, colmap_models};
use std::fs;
use std::path::Path;

/// Said of photographs that cannot share one camera.
const SIZES_DIFFER: &str = "photographs have different sizes; those of each size share a camera, whose principal point is \
                            held in the middle; photographs of one camera at one size give better poses";

impl Plan {
    /// Does everything and moves the result to `out`.
    pub(super) fn make(&self, work: WorkFolder, out: &Path, show: Show) -> Result<Report, Failure> {
        let mut progress = Progress::new(show, "import", self.colmap.len() as u64 + 1);
        if work.goes_on {
            progress.say(&format!("continuing from the finished steps in {}", self.root.display()));
        }
        let mut done = Done::default();
        let stages = self.photographs(&work, &mut done, &mut progress);
        if let Err(failure) = stages.and_then(|()| self.pose(&work, &mut done, &mut progress, show)) {
            progress.abandon("");
            return Err(failure);
        }
        progress.finish("");
        let (names, meaning, left_out) = match &self.source {
            Source::Photographs(set) => (set.names(), set.meaning, set.unread.clone()),
            Source::Video(_) => (work::entries(&work.join("images"))?, None, Vec::new()),
        };
        // Masks of what to ignore were stored as masks of what to use.
        let meaning = meaning.map(|m| if m == MaskMeaning::Ignore { MaskMeaning::Keep } else { m });
        let data = opened(&work, meaning, done.models[0].images.len())?;
        let report = Report::new(Made { out, names, done: &done, data: &data, meaning, left_out });
        for name in ["features.db", "features.db-wal", "features.db-shm", "feature_masks", PYCOLMAP_FILE] {
            work::remove(&work.join(name))?;
        }
        work.finish(out)?;
        Ok(report)
    }

    /// Copies photographs, or takes them from the video.
    fn photographs(
        &self,
        work: &WorkFolder,
        done: &mut Done,
        progress: &mut Progress,
    ) -> Result<(), Failure> {
        match &self.source {
            Source::Photographs(set) => {
                if set.shared == Shared::InFolders {
                    done.warnings.push(SIZES_DIFFER.to_owned());
                }
                set.copy(work, progress)
            }
            Source::Video(_) if Frames::are_taken(work) => Ok(()),
            Source::Video(frames) => {
                Frames::prepare(work)?;
                let time = stage::run(&frames.call(&self.root), &work.join(work::LOG), progress)?;
                done.times.push((Stage::Frames, time));
                frames.choose(work)
            }
        }
    }

    /// Calls COLMAP.
    fn pose(
        &self,
        work: &WorkFolder,
        done: &mut Done,
        progress: &mut Progress,
        show: Show,
    ) -> Result<(), Failure> {
        if self.uses_pycolmap() {
            let file = work.join(PYCOLMAP_FILE);
            let cannot = || format!("cannot write {}", file.display());
            fs::write(&file, PYCOLMAP).with_context(cannot).or_exit(Exit::Io)?;
        }
        for (before, call) in self.colmap.iter().enumerate() {
            progress.set(before as u64 + 1, "");
            if call.stage == Stage::Poses {
                // A model of an import that was stopped would be taken for one of this import.
                work::remove(&work.join("sparse"))?;
                create_folder(&work.join("sparse"))?;
            }
            match stage::run(call, &work.join(work::LOG), progress) {
                Ok(time) => {
                    // Plain lines say it by themselves.
                    if show == Show::Bar {
                        progress.say(&format!("{} took {}", call.stage.name(), clock(time)));
                    }
                    done.times.push((call.stage, time));
                }
                // The mapper's model is whole without it.
                Err(failure) if call.stage == Stage::Refinement && !interrupted() => {
                    let text = format!("the principal point stays in the middle: {}", failure.error);
                    done.warnings.push(text);
                }
                Err(failure) => return Err(failure),
            }
            if call.stage == Stage::Poses {
                done.models = keep_largest(work)?;
            }
        }
        Ok(())
    }
}

/// Moves the largest model to `sparse/0` and removes the others, whose coordinates are not its own. Returns all of them,
/// the largest first.
fn keep_largest(work: &WorkFolder) -> Result<Vec<ColmapModel>, Failure> {
    let sparse = work.join("sparse");
    let models = colmap_models(&sparse).map_err(data_failure)?;
    let posed = models.first().map_or(0, |model| model.images.len());
    if posed < FEWEST {
        let log = work.join(work::LOG);
        let text = format!(
            "COLMAP posed {posed} photographs, and at least {FEWEST} are needed: {TOO_LITTLE}; {} has its output",
            log.display()
        );
        return Err(Exit::BadInput.because(text));
    }
    let (others, first) = (work.join("models"), sparse.join("0"));
    work::remove(&others)?;
    let moved = fs::rename(&sparse, &others)
        .and_then(|()| fs::create_dir(&sparse))
        .and_then(|()| fs::rename(others.join(models[0].folder.file_name().unwrap_or_default()), &first));
    moved.with_context(|| format!("cannot move a model to {}", first.display())).or_exit(Exit::Io)?;
    work::remove(&others)?;
    Ok(models)
}

/// Opens the dataset as training will, so that "done" is never said of one that cannot be used.
fn opened(work: &WorkFolder, meaning: Option<MaskMeaning>, posed: usize) -> Result<Dataset, Failure> {
    let mask_meaning = meaning.filter(|m| *m == MaskMeaning::Keep);
    let options = OpenOptions { mask_meaning, ..OpenOptions::default() };
    let data = Dataset::open(work.path(), &options).map_err(data_failure)?;
    if data.views.len() == posed {
        return Ok(data);
    }
    let text = format!("{}: {} views can be read; expected {posed}", work.path().display(), data.views.len());
    Err(Exit::BadInput.because(text))
}
