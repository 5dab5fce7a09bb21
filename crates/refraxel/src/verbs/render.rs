//! `refraxel render`: renders new views of a run.

mod cameras;
mod depth;
mod folder;
mod paths;
mod refractive;
mod slices;
mod views;

use super::interrupts::watch_for_interrupts;
use super::loaded::{Loaded, load_run};
use super::{reopen, set_threads};
use crate::cli::RenderArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use anyhow::{Context, anyhow};
use cameras::{export, orbit, read};
use depth::Depth;
use folder::{Earlier, RenderFolder};
use paths::Fan;
use refraxel_data::NamedCamera;
use refraxel_data::synth::IndexTruth;
use refraxel_train::Backend;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::model::index_edit::{IndexEdit, typical_index};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use views::{Views, is_refractive, layer_name, render_all, units};

/// Names of the files beside the pictures of the views.
const CAMERAS: &str = "transforms.json";
const SLICES: &str = "index_slices.png";
const PATHS_PICTURE: &str = "paths.png";
const PATHS_LINES: &str = "paths.ply";

/// The files that were written; keys are absent where nothing was asked for.
#[derive(Default, Serialize)]
struct Report {
    out: PathBuf,
    views: usize,
    layers: Vec<&'static str>,
    /// Poses, intrinsics and the units of depth and index.
    #[serde(skip_serializing_if = "Option::is_none")]
    cameras: Option<PathBuf>,
    /// Slices of the index.
    #[serde(skip_serializing_if = "Option::is_none")]
    slices: Option<PathBuf>,
    /// Whether the slices show the truth.
    #[serde(skip_serializing_if = "Option::is_none")]
    truth_shown: Option<bool>,
    /// Bent rays, drawn and as polylines.
    #[serde(skip_serializing_if = "Option::is_none")]
    paths: Option<[PathBuf; 2]>,
    /// The typical index of each region, where it was edited.
    #[serde(skip_serializing_if = "Option::is_none")]
    edited_index: Option<Vec<f32>>,
}

/// The verb.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    refuse_films(&args.out)?;
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let mut run = load_run(&args.run)?;
    let mut report =
        Report { out: args.out.clone(), edited_index: edit_index(args, &mut run)?, ..Report::default() };
    refuse_straight(args, &run)?;
    let cameras = match (&args.cameras, args.orbit) {
        (Some(file), _) => read(file)?,
        (None, None) if args.paths.is_none() => Vec::new(),
        (None, count) => orbit(&run, count.unwrap_or(1) as usize)?,
    };
    let shown = if args.cameras.is_some() || args.orbit.is_some() { &cameras[..] } else { &[] };
    let depth = Depth::for_views(shown, &run.plan.finest);
    let views = Views { cameras: shown, layers: &args.outputs, depth };
    let earlier = if args.overwrite { Earlier::Remove } else { Earlier::Keep };
    let mut folder = RenderFolder::open(&args.out, &planned(args, &views), earlier)?;
    if !shown.is_empty() {
        let show = Show::suited(args.work.quiet || args.work.json);
        render_all(&mut run, &views, &mut folder, show)?;
        report.cameras = Some(write_cameras(&views, &mut folder)?);
        report.views = shown.len();
        report.layers = args.outputs.iter().map(|&l| layer_name(l)).collect();
    }
    if args.slices {
        let (path, truth_shown) = write_slices(args, &run, &mut folder)?;
        (report.slices, report.truth_shown) = (Some(path), Some(truth_shown));
    }
    if let (Some(count), Some(view)) = (args.paths, cameras.first()) {
        report.paths = Some(write_paths(&run, view, count as usize, &mut folder)?);
    }
    Console::new(args.work.json).result(&report.text(), &report).or_exit(Exit::Io)
}

/// Gives the loaded run another index if asked to. Returns the typical index of each region then.
fn edit_index(args: &RenderArgs, run: &mut Loaded) -> Result<Option<Vec<f32>>, Failure> {
    let edit = match (args.scale_index, args.set_index) {
        (Some(factor), _) => IndexEdit::Scale(factor as f32),
        (None, Some(n)) => IndexEdit::Set(n as f32),
        (None, None) => return Ok(None),
    };
    let mut refraction = run.backend.medium().clone();
    let failed = || format!("the index of {} cannot be changed", args.run.display());
    edit.apply(&mut refraction).with_context(failed).or_exit(Exit::BadInput)?;
    let typical = refraction.medium.regions().iter().map(|r| typical_index(r).unwrap_or(1.0)).collect();
    run.backend.set_medium(refraction);
    Ok(Some(typical))
}

/// Refuses pictures of the index of a run without any.
fn refuse_straight(args: &RenderArgs, run: &Loaded) -> Result<(), Failure> {
    let layer = args.outputs.iter().copied().find(|&l| is_refractive(l));
    let asked = match (layer, args.slices, args.paths) {
        (Some(layer), ..) => format!("--outputs {}", layer_name(layer)),
        (None, true, _) => "--slices".to_owned(),
        (None, false, Some(_)) => "--paths".to_owned(),
        (None, false, None) => return Ok(()),
    };
    if !run.backend.medium().is_none() {
        return Ok(());
    }
    let run = args.run.display();
    let error = anyhow!(
        "{asked} needs an index of refraction, but the rays of {run} are straight; train with refractive masks or with \
         --refraction on"
    );
    Err(Failure::new(Exit::BadInput, error))
}

/// All files that the options ask for, relative to the folder.
fn planned(args: &RenderArgs, views: &Views<'_>) -> BTreeSet<String> {
    let cameras = (!views.cameras.is_empty()).then_some(CAMERAS);
    let slices = args.slices.then_some(SLICES);
    let paths = args.paths.map(|_| [PATHS_PICTURE, PATHS_LINES]);
    let beside = cameras.into_iter().chain(slices).chain(paths.into_iter().flatten());
    views.pictures().chain(beside.map(str::to_owned)).collect()
}

/// Writes the cameras of the views and the units of their pictures.
fn write_cameras(views: &Views<'_>, folder: &mut RenderFolder) -> Result<PathBuf, Failure> {
    let document = export(views.cameras, units(views.depth.unit, views.layers));
    let text = serde_json::to_string_pretty(&document).or_exit(Exit::Io)?;
    folder.write(CAMERAS, |path| Ok(write_atomic(path, |f| f.write_all(text.as_bytes()))?))
}

/// Writes slices of the index; true when the truth is beside them, which an edited index does not have.
fn write_slices(
    args: &RenderArgs,
    run: &Loaded,
    folder: &mut RenderFolder,
) -> Result<(PathBuf, bool), Failure> {
    let edited = args.scale_index.or(args.set_index).is_some();
    // Slices need no dataset: without one they stand alone.
    let data = if edited { None } else { reopen(run).ok() };
    let truth = data.and_then(|d| IndexTruth::from_scene_json(d.truth.as_ref()?));
    let page = slices::sheet(run.backend.medium(), truth.as_ref()).draw();
    let path = folder.write(SLICES, |path| Ok(page.save_png(path)?))?;
    Ok((path, truth.is_some()))
}

/// Writes bent rays of a view as a picture and as polylines.
fn write_paths(
    run: &Loaded,
    view: &NamedCamera,
    count: usize,
    folder: &mut RenderFolder,
) -> Result<[PathBuf; 2], Failure> {
    let (refraction, domain) = (run.backend.medium(), run.backend.domain());
    let fans = Fan::of_regions(refraction, domain, &view.camera, count);
    let page = paths::sheet(&fans, refraction, &view.name).draw();
    let picture = folder.write(PATHS_PICTURE, |path| Ok(page.save_png(path)?))?;
    let lines = folder.write(PATHS_LINES, |path| Ok(write_atomic(path, |f| paths::write_ply(&fans, f))?))?;
    Ok([picture, lines])
}

fn refuse_films(out: &Path) -> Result<(), Failure> {
    let Some(extension) = out.extension().and_then(|e| e.to_str()) else { return Ok(()) };
    if !["mp4", "gif", "webm", "mov", "mkv", "avi"].contains(&extension.to_lowercase().as_str()) {
        return Ok(());
    }
    let error = anyhow!(
        "--out {}: pictures are written to a folder, not to a film; give a folder such as `{}`, and make the film from its \
         pictures, for example with `ffmpeg -i {}/%04d.png {}`",
        out.display(),
        out.with_extension("").display(),
        out.with_extension("").display(),
        out.display(),
    );
    Err(Failure::new(Exit::Usage, error))
}

impl Report {
    fn text(&self) -> String {
        let out = self.out.display();
        let views = self.cameras.as_ref().map(|cameras| {
            let (views, layers) = (self.views, self.layers.join(", "));
            format!("{views} views ({layers}) in {out}; cameras: {}", cameras.display())
        });
        let slices = self.slices.as_ref().map(|path| {
            let truth =
                if self.truth_shown == Some(true) { "beside the truth" } else { "the truth is not known" };
            format!("slices of the index: {} ({truth})", path.display())
        });
        let paths = self.paths.as_ref();
        let paths =
            paths.map(|[picture, lines]| format!("rays: {} and {}", picture.display(), lines.display()));
        let index = self.edited_index.as_ref().map(|indices| {
            let indices: Vec<String> = indices.iter().map(|n| format!("{n:.3}")).collect();
            format!("rendered with index {}; the run itself is not changed", indices.join(", "))
        });
        [views, slices, paths, index].into_iter().flatten().collect::<Vec<_>>().join("\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_are_refused_with_the_way_to_make_one() {
        let failure = refuse_films(Path::new("x/orbit.mp4")).unwrap_err();
        assert_eq!(failure.exit, Exit::Usage);
        assert!(
            failure.report().contains("`ffmpeg -i x/orbit/%04d.png x/orbit.mp4`"),
            "{}",
            failure.report()
        );
        assert!(refuse_films(Path::new("views.d")).is_ok() && refuse_films(Path::new("views")).is_ok());
    }
}
