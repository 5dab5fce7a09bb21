//! The walk of an export: the format decides what is taken from the run and which file is written.

use super::eyes::Eyes;
use super::report::Report;
use super::splats::Splats;
use super::spz::Lost;
use super::surfaces::Solids;
use super::surroundings::Surroundings;
use super::up::Up;
use super::{cameras, gltf, html, obj, ply, points};
use crate::cli::{ExportArgs, ExportFormat};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::shell::quoted_path;
use crate::table::count;
use crate::verbs::files::{absolute, write_text};
use crate::verbs::interrupts::watch_for_interrupts;
use crate::verbs::loaded::{Loaded, load_run};
use crate::verbs::reopen::reopen;
use refraxel_data::atomic::write_atomic;
use refraxel_train::Backend;
use refraxel_train::run::CHECKPOINT;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Points of a point cloud, unless said otherwise.
const POINTS: usize = 200_000;
/// Gaussians, unless said otherwise: at degree 2 they take 82 MB.
const SPLATS: usize = 500_000;

/// The verb.
pub fn run(args: &ExportArgs) -> Result<(), Failure> {
    let mut run = load_run(&args.run)?;
    let checkpoint = args.run.join(CHECKPOINT).display().to_string();
    let file = |name: &str| args.out.clone().unwrap_or_else(|| args.run.join(name));
    let (name, detail) = (checkpoint.as_str(), args.detail);
    let most = |usual: usize| args.points.map_or(usual, |n| n as usize);
    watch_for_interrupts()?;
    let report = match args.format {
        ExportFormat::Html => return page(args, &mut run, file("scene.html")),
        ExportFormat::Cameras => return write_cameras(args, &run, file("transforms.json")),
        ExportFormat::Points => return write_points(args, &run, most(POINTS), file("points.ply")),
        ExportFormat::Splats => return write_splats(args, &run, most(SPLATS), file("splats.ply")),
        ExportFormat::Ply => write_ply(&run, name, detail, &file("surface.ply"))?,
        ExportFormat::Obj => write_obj(&run, name, detail, &file("surface.obj"))?,
        ExportFormat::Gltf => write_gltf(&run, name, detail, most(0), &file("scene.glb"))?,
    };
    Console::new(args.json).result(&report.text(), &report).or_exit(Exit::Io)
}

/// Writes what is solid in a run, called `name` in messages, as PLY with `detail` cells per voxel.
pub fn write_ply(run: &Loaded, name: &str, detail: u32, file: &Path) -> Result<Report, Failure> {
    let solids = Solids::of(run, name, reopen(run).as_ref(), detail)?;
    write_atomic(file, |f| ply::write(&solids.all(), run.plan.origin, f))?;
    Ok(Report::new(file, "ply", &solids))
}

/// Writes what is solid in a run, called `name` in messages, as OBJ with `detail` cells per voxel.
pub fn write_obj(run: &Loaded, name: &str, detail: u32, file: &Path) -> Result<Report, Failure> {
    let solids = Solids::of(run, name, reopen(run).as_ref(), detail)?;
    write_atomic(file, |f| obj::write(&solids.all(), run.plan.origin, f))?;
    Ok(Report::new(file, "obj", &solids))
}

/// Writes what is solid in a run, called `name` in messages, as glTF with `detail` cells per voxel, and where its dataset can be
/// opened, the cameras, and at most so many points of opaque things.
pub fn write_gltf(
    run: &Loaded,
    name: &str,
    detail: u32,
    points: usize,
    file: &Path,
) -> Result<Report, Failure> {
    let data = reopen(run);
    let solids = Solids::of(run, name, data.as_ref(), detail)?;
    let around =
        data.as_ref().map_or(Ok(Surroundings::default()), |data| Surroundings::of(run, data, points))?;
    let up = Up::estimate(data);
    write_atomic(file, |f| {
        gltf::write(&solids.glass, solids.opaque.as_ref(), &around, &up, run.plan.origin, f)
    })?;
    Ok(Report {
        points: Some(around.points.len()),
        cameras: Some(around.cameras.len()),
        up: Some(up.direction.to_array()),
        up_note: up.note,
        ..Report::new(file, "gltf", &solids)
    })
}

/// Writes what the photographs' cameras see as coloured points.
fn write_points(args: &ExportArgs, run: &Loaded, most: usize, file: PathBuf) -> Result<(), Failure> {
    let points = Surroundings::of(run, &reopen(run)?, most)?.points;
    write_atomic(&file, |f| points::write(&points, run.plan.origin, f))?;
    let text = format!(
        "points: {} ({} points of opaque things, world coordinates of the dataset; rays that glass turns give none)",
        file.display(),
        count(points.len() as u64)
    );
    let report = json!({ "file": file, "format": "points", "points": points.len() });
    Console::new(args.json).result(&text, &report).or_exit(Exit::Io)
}

/// Writes the field as Gaussians.
fn write_splats(args: &ExportArgs, run: &Loaded, most: usize, file: PathBuf) -> Result<(), Failure> {
    let data = reopen(run);
    let weights = data.as_ref().ok().map(|data| Eyes::of(run, data).weights()).transpose()?;
    let snapshot = run.backend.snapshot();
    let model = &snapshot.model;
    let splats = Splats::of(&model.field, weights.as_deref(), most);
    if splats.len() == 0 {
        return Err(Exit::BadInput.because(format!(
            "{} has nothing to export: nothing in it is opaque yet; train longer",
            args.run.display()
        )));
    }
    let mut notes = splats.notes(model);
    let is_spz = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("spz"));
    if is_spz {
        let mut lost = Lost::default();
        write_atomic(&file, |f| splats.write_spz(&model.field, f).map(|found| lost = found))?;
        notes.push(format!(
            "SPZ rounds places to {:.1e} scene units, and other numbers to 4 to 8 bits; the PLY layout rounds nothing",
            lost.step
        ));
        notes.push("SPZ has y and z of the world with reversed signs".to_owned());
        if lost.of_other_size > 0 {
            notes.push(format!(
                "{} Gaussians are smaller or larger than SPZ can store, which is from 4.5e-5 to 380 scene units; the PLY layout keeps them",
                count(lost.of_other_size as u64)
            ));
        }
    } else {
        write_atomic(&file, |f| splats.write(&model.field, run.plan.origin, f))?;
    }
    if !run.plan.origin.is_of_world() {
        let [x, y, z] = run.plan.origin.place().to_array();
        notes.push(format!(
            "places are relative to ({x}, {y}, {z}) of the dataset: the layout has single precision only"
        ));
    }
    if let Err(failure) = &data {
        notes.push(format!(
            "the photographs cannot be read, so the most opaque voxels come first: {}",
            failure.error
        ));
    }
    let text = format!(
        "splats: {} ({} Gaussians, world coordinates of the dataset; for viewers of 3D Gaussian splatting)",
        file.display(),
        count(splats.len() as u64)
    );
    let text = std::iter::once(text)
        .chain(notes.iter().map(|n| format!("note: {n}")))
        .collect::<Vec<_>>()
        .join("\n");
    let report = json!({
        "file": file, "format": "splats", "splats": splats.len(), "left_out": splats.left_out, "share": splats.share, "notes": notes,
    });
    Console::new(args.json).result(&text, &report).or_exit(Exit::Io)
}

/// Writes a page to share.
fn page(args: &ExportArgs, run: &mut Loaded, file: PathBuf) -> Result<(), Failure> {
    let html::Page { voxels, bytes, colours } = html::write(run, &args.run, &file)?;
    let text = format!(
        "page: {} ({:.1} MB, {:.0} % of it the colours of {} voxels: a run with a smaller grid.resolution or field.sh_degree has a \
         smaller page); any browser opens it, one with WebGPU shows the scene itself",
        file.display(),
        bytes as f64 / 1e6,
        100.0 * colours as f64 / bytes as f64,
        count(voxels as u64),
    );
    let report = json!({ "file": file, "format": "html", "voxels": voxels, "bytes": bytes, "bytes_of_colours": colours });
    Console::new(args.json).result(&text, &report).or_exit(Exit::Io)
}

/// Writes where the photographs were taken, for other programs and for another run.
fn write_cameras(args: &ExportArgs, run: &Loaded, file: PathBuf) -> Result<(), Failure> {
    let data = reopen(run)?;
    if args.out.is_some() && file.exists() {
        return Err(Exit::BadInput.because(format!(
            "{} exists, and may be where the photographs' own cameras are stated; choose another name, such as learned.json",
            file.display()
        )));
    }
    let folder = absolute(&file).parent().map_or_else(PathBuf::new, Path::to_owned);
    let text = cameras::transforms(&data, &run.alignment, &folder)?;
    write_text(&file, &text)?;
    let learned = match &run.alignment.poses {
        Some(poses) if poses.learns_lenses() => "poses and lenses as learned",
        Some(_) => "poses as learned",
        None => "poses as the data state them, because none were learned",
    };
    let said = format!(
        "cameras: {} ({} photographs, {learned}; of held-out ones the poses are those of the data); train from it: refraxel \
         train {} --allow-outside --out OTHER, with what else said how to read the photographs (--crop, --up, --backdrop, --alpha, \
         --mask-meaning, --orientation)",
        file.display(),
        data.views.len(),
        quoted_path(&file),
    );
    let report =
        json!({ "file": file, "format": "cameras", "cameras": data.views.len(), "learned": learned });
    Console::new(args.json).result(&said, &report).or_exit(Exit::Io)
}
