//! The walk of a render: what is asked for is checked, then views are chosen, then a film or a folder is written.

use super::cameras;
use super::depth::Depth;
use super::film::{Film, Format};
use super::report::{FilmReport, Report};
use super::views::{Views, film_all, is_refractive};
use super::writing::write_folder;
use crate::cli::RenderArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::interrupts::watch_for_interrupts;
use crate::verbs::loaded::{Loaded, load_run};
use crate::verbs::threads::set_threads;
use anyhow::Context;
use refraxel_train::Backend;
use refraxel_train::model::index_edit::{IndexEdit, typical_index};

/// Frames per second of a film, where nobody says how many.
const FPS: f64 = 24.0;

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
            report.layers = args.outputs.iter().map(|l| l.name()).collect();
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

/// Refuses options of films for a folder, and of folders for a film.
fn refuse_mixed(args: &RenderArgs, format: Option<Format>) -> Result<(), Failure> {
    let out = args.out.display();
    let why = match format {
        None if args.fps.is_some() => {
            format!("--fps is for films; give a name such as {out}.mp4 as --out, or leave --fps out")
        }
        Some(_) if args.slices || args.paths.is_some() => {
            format!("--slices and --paths are single pictures; give a folder as --out, not the film {out}")
        }
        Some(_) if args.outputs.len() != 1 => {
            format!(
                "a film shows one layer; found --outputs with {}; give one film for each",
                args.outputs.len()
            )
        }
        _ => return Ok(()),
    };
    Err(Exit::Usage.because(why))
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
        (Some(layer), ..) => format!("--outputs {}", layer.name()),
        (None, true, _) => "--slices".to_owned(),
        (None, false, Some(_)) => "--paths".to_owned(),
        (None, false, None) => return Ok(()),
    };
    if !run.backend.medium().is_none() {
        return Ok(());
    }
    let run = args.run.display();
    Err(Exit::BadInput.because(format!(
        "{asked} needs an index of refraction, but the rays of {run} are straight; train with refractive masks or with \
         --refraction on"
    )))
}
