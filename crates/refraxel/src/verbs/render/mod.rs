//! `refraxel render`: renders new views of a run.

mod camera_path;
mod cameras;
mod depth;
mod film;
mod folder;
pub(crate) mod paths;
pub(crate) mod refractive;
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
use cameras::export;
pub use cameras::intrinsics;
use depth::Depth;
use film::{Film, Format};
use folder::{Earlier, RenderFolder};
use paths::Fan;
use refraxel_data::NamedCamera;
use refraxel_data::synth::IndexTruth;
use refraxel_train::Backend;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::model::index_edit::{IndexEdit, typical_index};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::PathBuf;
use views::{Views, film_all, is_refractive, layer_name, render_all, units};

/// Names of the files beside the pictures of the views.
const CAMERAS: &str = "transforms.json";
const SLICES: &str = "index_slices.png";
const PATHS_PICTURE: &str = "paths.png";
const PATHS_LINES: &str = "paths.ply";
/// Frames per second of a film, where nobody says how many.
const FPS: f64 = 24.0;

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
    /// The film; no other file was written then.
    #[serde(skip_serializing_if = "Option::is_none")]
    film: Option<FilmReport>,
    /// The typical index of each region, where it was edited.
    #[serde(skip_serializing_if = "Option::is_none")]
    edited_index: Option<Vec<f32>>,
}

/// A film that was written.
#[derive(Serialize)]
struct FilmReport {
    frames: usize,
    fps: f64,
    size: [u32; 2],
}

/// The verb.
pub fn run(args: &RenderArgs) -> Result<(), Failure> {
    let format = Format::of(&args.out)?;
    refuse_mixed(args, format)?;
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let mut run = load_run(&args.run)?;
    let mut report =
        Report { out: args.out.clone(), edited_index: edit_index(args, &mut run)?, ..Report::default() };
    refuse_straight(args, &run)?;
    let (cameras, fps) = cameras::chosen(args, &run)?;
    let is_shown = args.paths.is_none() || cameras_are_asked_for(args);
    let shown = if is_shown { &cameras[..] } else { &[] };
    let depth = Depth::for_views(shown, &run.plan.finest);
    let views = Views { cameras: shown, layers: &args.outputs, depth, device: args.renderer.device };
    let show = Show::suited(args.work.quiet || args.work.json);
    match format {
        Some(format) => {
            let fps = args.fps.or(fps).unwrap_or(FPS);
            let size = views.common_size()?;
            let mut film = Film::begin(&args.out, format, size, fps, args.overwrite)?;
            film_all(&mut run, &views, &mut film, show)?;
            film.finish()?;
            report.film = Some(FilmReport { frames: shown.len(), fps, size });
            report.layers = args.outputs.iter().map(|&l| layer_name(l)).collect();
        }
        None => write_folder(args, (&mut run, &cameras), &views, show, &mut report)?,
    }
    Console::new(args.work.json).result(&report.text(), &report).or_exit(Exit::Io)
}

/// Views are rendered; otherwise cameras are only needed to draw rays.
fn cameras_are_asked_for(args: &RenderArgs) -> bool {
    let files = [&args.cameras, &args.camera_path, &args.keyframes];
    files.iter().any(|file| file.is_some()) || args.orbit.is_some() || args.spiral.is_some()
}

/// Writes pictures of all views, slices and paths to a folder.
fn write_folder(
    args: &RenderArgs,
    (run, cameras): (&mut Loaded, &[NamedCamera]),
    views: &Views<'_>,
    show: Show,
    report: &mut Report,
) -> Result<(), Failure> {
    let earlier = if args.overwrite { Earlier::Remove } else { Earlier::Keep };
    let mut folder = RenderFolder::open(&args.out, &planned(args, views), earlier)?;
    if !views.cameras.is_empty() {
        render_all(run, views, &mut folder, show)?;
        report.cameras = Some(write_cameras(views, &mut folder)?);
        report.views = views.cameras.len();
        report.layers = args.outputs.iter().map(|&l| layer_name(l)).collect();
    }
    if args.slices {
        let (path, truth_shown) = write_slices(args, run, &mut folder)?;
        (report.slices, report.truth_shown) = (Some(path), Some(truth_shown));
    }
    if let (Some(count), Some(view)) = (args.paths, cameras.first()) {
        report.paths = Some(write_paths(run, view, count as usize, &mut folder)?);
    }
    Ok(())
}

/// Refuses options of films for a folder, and of folders for a film.
fn refuse_mixed(args: &RenderArgs, format: Option<Format>) -> Result<(), Failure> {
    let out = args.out.display();
    let error = match format {
        None if args.fps.is_some() => {
            anyhow!("--fps is for films; give a name such as {out}.mp4 as --out, or leave --fps out")
        }
        Some(_) if args.slices || args.paths.is_some() => {
            anyhow!("--slices and --paths are single pictures; give a folder as --out, not the film {out}")
        }
        Some(_) if args.outputs.len() != 1 => {
            anyhow!(
                "a film shows one layer; found --outputs with {}; give one film for each",
                args.outputs.len()
            )
        }
        _ => return Ok(()),
    };
    Err(Failure::new(Exit::Usage, error))
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

impl Report {
    fn text(&self) -> String {
        let out = self.out.display();
        let views = self.cameras.as_ref().map(|cameras| {
            let (views, layers) = (self.views, self.layers.join(", "));
            format!("{views} views ({layers}) in {out}; cameras: {}", cameras.display())
        });
        let film = self.film.as_ref().map(|film| {
            let ([width, height], layers) = (film.size, self.layers.join(", "));
            let seconds = film.frames as f64 / film.fps;
            format!("{out}: {} frames ({layers}), {width} x {height} pixels, {seconds:.1} s", film.frames)
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
        [views, film, slices, paths, index].into_iter().flatten().collect::<Vec<_>>().join("\n")
    }
}
