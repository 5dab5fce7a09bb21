//! The walk of an export: the format decides what is taken from the run and which file is written.

use super::report::Report;
use super::surfaces::surfaces;
use super::surroundings::Surroundings;
use super::up::Up;
use super::{cameras, gltf, html, ply};
use crate::cli::{ExportArgs, ExportFormat};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::shell::quoted_path;
use crate::table::count;
use crate::verbs::files::absolute;
use crate::verbs::interrupts::watch_for_interrupts;
use crate::verbs::loaded::{Loaded, load_run};
use crate::verbs::reopen::reopen;
use anyhow::anyhow;
use refraxel_train::Backend;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::run::CHECKPOINT;
use serde_json::json;
use std::path::{Path, PathBuf};

/// The verb.
pub fn run(args: &ExportArgs) -> Result<(), Failure> {
    let mut run = load_run(&args.run)?;
    let checkpoint = args.run.join(CHECKPOINT).display().to_string();
    let file = |name: &str| args.out.clone().unwrap_or_else(|| args.run.join(name));
    let report = match args.format {
        ExportFormat::Html => return page(args, &mut run, file("scene.html")),
        ExportFormat::Cameras => return write_cameras(args, &run, file("transforms.json")),
        ExportFormat::Ply => write_ply(&run, &checkpoint, args.detail, &file("surface.ply"))?,
        ExportFormat::Gltf => {
            watch_for_interrupts()?;
            write_gltf(&run, &checkpoint, args.detail, args.points as usize, &file("scene.glb"))?
        }
    };
    Console::new(args.json).result(&report.text(), &report).or_exit(Exit::Io)
}

/// Writes the surfaces of a run, called `name` in messages, as PLY with `detail` cells per voxel.
pub fn write_ply(run: &Loaded, name: &str, detail: u32, file: &Path) -> Result<Report, Failure> {
    let surfaces = surfaces(run.backend.medium(), name, detail)?;
    write_atomic(file, |f| ply::write(&surfaces, f))?;
    Ok(Report::new(file, "ply", &surfaces))
}

/// Writes the surfaces of a run, called `name` in messages, as glTF with `detail` cells per voxel, and where its dataset can be
/// opened, at most so many points of opaque things, and the cameras.
pub fn write_gltf(
    run: &Loaded,
    name: &str,
    detail: u32,
    points: usize,
    file: &Path,
) -> Result<Report, Failure> {
    let surfaces = surfaces(run.backend.medium(), name, detail)?;
    let data = reopen(run);
    let around =
        data.as_ref().map_or(Ok(Surroundings::default()), |data| Surroundings::of(run, data, points))?;
    let up = Up::estimate(data);
    write_atomic(file, |f| gltf::write(&surfaces, &around, &up, f))?;
    Ok(Report {
        points: Some(around.points.len()),
        cameras: Some(around.cameras.len()),
        up: Some(up.direction.to_array()),
        up_note: up.note,
        ..Report::new(file, "gltf", &surfaces)
    })
}

/// Writes a page to share.
fn page(args: &ExportArgs, run: &mut Loaded, file: PathBuf) -> Result<(), Failure> {
    let html::Page { voxels, bytes } = html::write(run, &args.run, &file)?;
    let text = format!(
        "page: {} ({} voxels, {:.1} MB); any browser opens it, one with WebGPU shows the scene itself",
        file.display(),
        count(voxels as u64),
        bytes as f64 / 1e6
    );
    let report = json!({ "file": file, "format": "html", "voxels": voxels, "bytes": bytes });
    Console::new(args.json).result(&text, &report).or_exit(Exit::Io)
}

/// Writes where the photographs were taken, for other programs and for another run.
fn write_cameras(args: &ExportArgs, run: &Loaded, file: PathBuf) -> Result<(), Failure> {
    let data = reopen(run)?;
    if args.out.is_some() && file.exists() {
        let error = anyhow!(
            "{} exists, and may be where the photographs' own cameras are stated; choose another name, such as learned.json",
            file.display()
        );
        return Err(Failure::new(Exit::BadInput, error));
    }
    let folder = absolute(&file).parent().map_or_else(PathBuf::new, Path::to_owned);
    let text = cameras::transforms(&data, &run.alignment, &folder)?;
    write_atomic(&file, |f| f.write_all(text.as_bytes()))?;
    let learned = match &run.alignment.poses {
        Some(poses) if poses.learns_lenses() => "poses and lenses as learned",
        Some(_) => "poses as learned",
        None => "poses as the data say, for none were learned",
    };
    let said = format!(
        "cameras: {} ({} photographs, {learned}; of held-out ones the poses are those of the data); train from it: refraxel \
         train {} --allow-outside --out OTHER, with what else said how to read the photographs (--crop, --up, --mask-meaning)",
        file.display(),
        data.views.len(),
        quoted_path(&file),
    );
    let report =
        json!({ "file": file, "format": "cameras", "cameras": data.views.len(), "learned": learned });
    Console::new(args.json).result(&said, &report).or_exit(Exit::Io)
}
