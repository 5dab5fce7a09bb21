//! `refraxel import`: poses for plain photographs or a video, by COLMAP and ffmpeg.

mod calls;
mod frames;
mod photos;
mod report;
mod script;
mod sharp;
mod stage;
mod tools;
mod work;

use super::interrupts::{interrupted, watch_for_interrupts};
use super::{create_folder, data_failure, set_threads};
use crate::cli::{ImportArgs, Matching};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show, clock};
use anyhow::{Context, anyhow};
use calls::{Call, Dialect, Pairs, Settings, Shared, Stage, TOO_LITTLE};
use frames::Frames;
use photos::{FEWEST, PhotoSet};
use refraxel_data::photographs::is_video;
use refraxel_data::{ColmapModel, DataError, Dataset, MaskMeaning, OpenOptions, colmap_models};
use report::{Made, Report};
use serde::Serialize;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, UNIX_EPOCH};
use tools::Colmap;
use work::WorkFolder;

/// Photographs of which every pair is compared, at most: 19 900 pairs.
const ALL_PAIRS: usize = 200;

/// Said of photographs that cannot share one camera.
const SIZES_DIFFER: &str = "photographs have different sizes; those of each size share a camera, whose principal point is \
                            held in the middle; photographs of one camera at one size give better poses";

/// The verb.
pub fn run(args: &ImportArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    // Everything that can be wrong with the input is found before the first file is written.
    work::refuse_earlier(&args.out, args.overwrite)?;
    let root = work::path_for(&args.out)?;
    let colmap = tools::colmap()?;
    let (source, is_missing_ffmpeg) = Source::of(args)?;
    let plan = Plan::new(args, source, root, colmap.as_ref());
    let script = script::lines(&plan.source, &plan.colmap, &plan.root, &args.out);
    let console = Console::new(args.work.json);
    if args.dry_run {
        return console.result(&script.join("\n"), &DryRun { commands: &script }).or_exit(Exit::Io);
    }
    let missing = [(colmap.is_none(), "COLMAP"), (is_missing_ffmpeg, "ffmpeg")];
    let missing: Vec<&str> = missing.into_iter().filter(|(is, _)| *is).map(|(_, name)| name).collect();
    let Some(colmap) = colmap.filter(|_| missing.is_empty()) else {
        return Err(tools::missing(&missing, &script));
    };
    watch_for_interrupts()?;
    let work = WorkFolder::open(&plan.root, &plan.record(args, &colmap))?;
    let show = Show::suited(args.work.quiet || args.work.json);
    let report = plan.make(work, &args.out, show).map_err(|failure| kept(failure, &plan.root))?;
    console.result(&report.text(), &report).or_exit(Exit::Io)
}

#[derive(Serialize)]
struct DryRun<'a> {
    commands: &'a [String],
}

/// The failure, and that the work is not lost.
fn kept(failure: Failure, root: &Path) -> Failure {
    if !root.is_dir() {
        return failure;
    }
    let report = failure.report();
    let text = report.strip_prefix("error: ").unwrap_or(&report);
    let root = root.display();
    let text = format!("{text}\nwhat is done is kept in {root}, and the same command goes on from there");
    Failure::new(failure.exit, anyhow!(text))
}

/// Where the photographs come from.
enum Source {
    Photographs(PhotoSet),
    Video(Frames),
}

impl Source {
    /// What the command line names, and whether ffmpeg is needed and missing.
    fn of(args: &ImportArgs) -> Result<(Self, bool), Failure> {
        let usage = |text: String| Err(Failure::new(Exit::Usage, anyhow!(text)));
        let path = &args.source;
        if !path.exists() {
            return Err(data_failure(DataError::NotFound { path: path.clone() }));
        }
        if path.is_dir() {
            if args.photographs.is_some() {
                return usage(
                    "--photographs is for videos; of a folder all photographs are posed".to_owned(),
                );
            }
            return PhotoSet::of(args).map(|set| (Self::Photographs(set), false));
        }
        if !is_video(path) {
            let text = format!(
                "{} is neither a folder of photographs nor a video, such as .mp4 or .mov",
                path.display()
            );
            return Err(Failure::new(Exit::BadInput, anyhow!(text)));
        }
        if args.masks.is_some() {
            let text = "--masks is for photographs; import the video, make masks of images in the result, and import \
                        those with --masks";
            return usage(text.to_owned());
        }
        let has_ffmpeg = tools::has_ffmpeg()?;
        let count = args.photographs.map_or(frames::USUAL, |n| n as usize);
        Frames::of(path, count, has_ffmpeg).map(|frames| (Self::Video(frames), !has_ffmpeg))
    }
}

/// An import, before anything is written.
struct Plan {
    source: Source,
    root: PathBuf,
    settings: Settings,
    /// The calls of COLMAP.
    colmap: Vec<Call>,
}

impl Plan {
    fn new(args: &ImportArgs, source: Source, root: PathBuf, colmap: Option<&Colmap>) -> Self {
        let (shared, masks, follow) = match &source {
            Source::Photographs(set) => (set.shared, set.meaning.is_some(), set.photos.len() > ALL_PAIRS),
            Source::Video(_) => (Shared::ByAll, false, true),
        };
        let pairs = match args.matching {
            Some(Matching::Exhaustive) => Pairs::All,
            Some(Matching::Sequential) => Pairs::Neighbours,
            None if follow => Pairs::Neighbours,
            None => Pairs::All,
        };
        let dialect = colmap.map_or(Dialect::usual(), |colmap| colmap.dialect);
        let threads = args.work.threads.map(usize::from);
        let settings = Settings { dialect, pairs, shared, masks, threads };
        let colmap = calls::colmap(&root, &settings);
        Self { source, root, settings, colmap }
    }

    /// Everything that the features and matches of an earlier import depend on.
    fn record(&self, args: &ImportArgs, colmap: &Colmap) -> Value {
        let stamp = |path: &Path| {
            let found = path.metadata().ok();
            let changed = found.as_ref().and_then(|f| f.modified().ok()?.duration_since(UNIX_EPOCH).ok());
            json!([path, found.map(|f| f.len()), changed.map(|time| time.as_millis() as u64)])
        };
        let (files, meaning, frames): (Vec<Value>, _, _) = match &self.source {
            Source::Photographs(set) => {
                let files = set.photos.iter().flat_map(|p| [Some(&p.file), p.mask.as_ref()]);
                (files.flatten().map(|path| stamp(path)).collect(), set.meaning, None)
            }
            Source::Video(frames) => {
                (vec![stamp(&frames.video)], None, Some(frames.call(&self.root).to_string()))
            }
        };
        // The number of threads changes nothing.
        let colmap_calls = calls::colmap(&self.root, &Settings { threads: None, ..self.settings });
        let calls: Vec<String> = frames.into_iter().chain(colmap_calls.iter().map(Call::to_string)).collect();
        json!({
            "source": super::absolute(&args.source),
            "colmap": colmap.version,
            "commands": calls,
            "mask_meaning": meaning.map(super::meaning_name),
            "files": files,
        })
    }

    /// Does everything and moves the result to `out`.
    fn make(&self, work: WorkFolder, out: &Path, show: Show) -> Result<Report, Failure> {
        let mut progress = Progress::new(show, "import", self.colmap.len() as u64 + 1);
        if work.goes_on {
            progress.say(&format!("going on from what {} holds", self.root.display()));
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
        for name in ["features.db", "features.db-wal", "features.db-shm", "feature_masks"] {
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

/// What the stages of an import have given.
#[derive(Default)]
struct Done {
    times: Vec<(Stage, Duration)>,
    /// The largest first.
    models: Vec<ColmapModel>,
    warnings: Vec<String>,
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
        return Err(Failure::new(Exit::BadInput, anyhow!(text)));
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
    Err(Failure::new(Exit::BadInput, anyhow!(text)))
}
