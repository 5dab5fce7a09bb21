//! The files of a render in its folder: pictures of the views, and what lies beside them.

use super::cameras::export;
use super::folder::RenderFolder;
use super::paths::{self, Fan};
use super::report::Report;
use super::slices;
use super::views::{Views, render_all, units};
use crate::cli::RenderArgs;
use crate::exit::Failure;
use crate::progress::Show;
use crate::verbs::files::write_json;
use crate::verbs::loaded::Loaded;
use crate::verbs::reopen::reopen;
use refraxel_data::atomic::write_atomic;
use refraxel_data::{LocalOrigin, NamedCamera};
use refraxel_train::Backend;
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Names of the files beside the pictures of the views.
const CAMERAS: &str = "transforms.json";
const SLICES: &str = "index_slices.png";
const PATHS_PICTURE: &str = "paths.png";
const PATHS_LINES: &str = "paths.ply";

/// Writes pictures of all views, slices and paths to a folder.
pub(super) fn write_folder(
    args: &RenderArgs,
    (run, cameras): (&mut Loaded, &[NamedCamera]),
    views: &Views<'_>,
    show: Show,
    report: &mut Report,
) -> Result<(), Failure> {
    let mut folder = RenderFolder::open(&args.out, &planned(args, views), args.overwrite)?;
    if !views.cameras.is_empty() {
        render_all(run, views, &mut folder, show)?;
        report.cameras = Some(write_cameras(views, run.plan.origin, &mut folder)?);
        report.views = views.cameras.len();
        report.layers = args.outputs.iter().map(|l| l.name()).collect();
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

/// All files that the options ask for, relative to the folder.
fn planned(args: &RenderArgs, views: &Views<'_>) -> BTreeSet<String> {
    let cameras = (!views.cameras.is_empty()).then_some(CAMERAS);
    let slices = args.slices.then_some(SLICES);
    let paths = args.paths.map(|_| [PATHS_PICTURE, PATHS_LINES]);
    let beside = cameras.into_iter().chain(slices).chain(paths.into_iter().flatten());
    views.pictures().chain(beside.map(str::to_owned)).collect()
}

/// Writes the cameras of the views in the user's world, and the units of their pictures.
fn write_cameras(
    views: &Views<'_>,
    origin: LocalOrigin,
    folder: &mut RenderFolder,
) -> Result<PathBuf, Failure> {
    let cameras: Vec<NamedCamera> = views.cameras.iter().map(|c| origin.to_world(c.clone())).collect();
    let document = export(&cameras, units(views.depth.unit, views.layers));
    folder.write(CAMERAS, |path| write_json(path, &document))
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
    let truth = data.and_then(|d| d.index_truth());
    let page = slices::sheet(run.backend.medium(), truth.as_ref(), run.plan.origin).draw();
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
    let lines = folder.write(PATHS_LINES, |path| {
        Ok(write_atomic(path, |f| paths::write_ply(&fans, run.plan.origin, f))?)
    })?;
    Ok([picture, lines])
}
