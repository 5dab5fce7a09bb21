//! `refraxel export`: writes a run for other programs, and for browsers.
//!
//! Each region gets the mesh of its whole surface. Where bodies lie in each other the later region rules, theory (2.23): a
//! bubble is a closed surface of index 1 inside that of the glass, and where two overlap in part both surfaces run through
//! each other. Neither PLY nor glTF can state this order; path tracers know it as the priority of nested dielectrics.

mod cameras;
mod gltf;
mod html;
mod ply;
mod surroundings;
mod up;

use super::interrupts::watch_for_interrupts;
use super::loaded::{Loaded, load_run};
use super::{absolute, reopen};
use crate::cli::{ExportArgs, ExportFormat};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::shell::quoted_path;
use crate::table::{colours, count};
use anyhow::anyhow;
use refraxel_core::Vec3;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::model::surface::{Boundary, Surface};
use refraxel_train::run::CHECKPOINT;
use refraxel_train::{Backend, Refraction};
use serde::Serialize;
use serde_json::json;
use std::path::{Path, PathBuf};
use surroundings::Surroundings;
use up::Up;

/// What was written.
#[derive(Serialize)]
pub struct Report {
    file: PathBuf,
    format: &'static str,
    regions: Vec<Region>,
    /// Points of opaque things, and cameras, in a glTF file.
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cameras: Option<usize>,
    /// The direction in the world that the glTF file turns to +y.
    #[serde(skip_serializing_if = "Option::is_none")]
    up: Option<[f64; 3]>,
    /// Why `up` is not the mean upward direction of the cameras.
    #[serde(skip_serializing_if = "Option::is_none")]
    up_note: Option<String>,
}

/// The mesh of one region.
#[derive(Serialize)]
struct Region {
    /// Number of the region, from 1.
    region: usize,
    /// "jump" or "half-way": where the boundary was drawn.
    boundary: &'static str,
    /// Index of refraction inside.
    index: f32,
    /// Absorption of linear red, green and blue [1 / scene unit].
    absorption: [f32; 3],
    vertices: usize,
    faces: usize,
    /// Closed surfaces: two for a hollow ball.
    bodies: usize,
    /// [scene unit²]
    area: f64,
    /// [scene unit³], without cavities.
    volume: f64,
    /// Corners of the box around it [scene unit].
    bounds: [[f64; 3]; 2],
}

/// One region's surface and its number, from 1.
struct Numbered {
    region: usize,
    surface: Surface,
}

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

/// The surfaces of all regions that have one. Errors where none has one.
fn surfaces(refraction: &Refraction, name: &str, detail: u32) -> Result<Vec<Numbered>, Failure> {
    let refuse =
        |problem: &str| Failure::new(Exit::BadInput, anyhow!("{name} has no surface to export: {problem}"));
    if refraction.is_none() {
        return Err(refuse(
            "its rays are straight; train with refractive masks, --refraction-box or --index-from",
        ));
    }
    let regions = refraction.medium.regions();
    if !regions.iter().all(|r| Surface::fits(r, detail)) {
        return Err(refuse(&format!("--detail {detail} needs too much memory; try a smaller one")));
    }
    let all = regions.iter().enumerate();
    let all = all.filter_map(|(k, r)| Some(Numbered { region: k + 1, surface: Surface::of(r, detail)? }));
    // Vacuum has a surface only where it lies in a body.
    let shows = |n: &Numbered| {
        let is_bubble = !refraction.medium.neighbours(n.region - 1).is_empty();
        !n.surface.mesh.triangles.is_empty() && (is_bubble || n.surface.index != 1.0)
    };
    let found: Vec<Numbered> = all.filter(shows).collect();
    if found.is_empty() {
        return Err(refuse(
            "its index is 1 everywhere; look at the index with `refraxel render RUN --slices --out DIR`, and train longer or with better masks",
        ));
    }
    Ok(found)
}

impl Region {
    fn of(Numbered { region, surface }: &Numbered) -> Option<Self> {
        let (mesh, bounds) = (&surface.mesh, surface.mesh.bounds()?);
        Some(Self {
            region: *region,
            boundary: match surface.boundary {
                Boundary::Jump => "jump",
                Boundary::HalfWay => "half-way",
            },
            index: surface.index,
            absorption: surface.absorption,
            vertices: mesh.vertices.len(),
            faces: mesh.triangles.len(),
            bodies: mesh.bodies(),
            area: mesh.area(),
            volume: mesh.volume(),
            bounds: [bounds.min.to_array(), bounds.max.to_array()],
        })
    }

    fn text(&self) -> String {
        let bodies = if self.bodies == 1 { "closed surface" } else { "closed surfaces" };
        let [x, y, z] = [0, 1, 2].map(|a| self.bounds[1][a] - self.bounds[0][a]);
        format!(
            "region {}: index {:.3}{}, {} vertices, {} faces, {} {bodies}, volume {:.4e}, area {:.4e}, box {x:.4} × {y:.4} × {z:.4}",
            self.region,
            self.index,
            self.tint(),
            count(self.vertices as u64),
            count(self.faces as u64),
            self.bodies,
            self.volume,
            self.area,
        )
    }
}

impl Region {
    /// What it absorbs, if it is tinted.
    fn tint(&self) -> String {
        if self.absorption == [0.0; 3] {
            String::new()
        } else {
            format!(", absorbs {}", colours(self.absorption))
        }
    }
}

impl Report {
    fn new(file: &Path, format: &'static str, surfaces: &[Numbered]) -> Self {
        let regions = surfaces.iter().filter_map(Region::of).collect();
        Self { file: file.to_owned(), format, regions, points: None, cameras: None, up: None, up_note: None }
    }

    fn text(&self) -> String {
        let lines = self.regions.iter().map(Region::text);
        let around = self.points.zip(self.cameras).map(|(points, cameras)| {
            format!("around it: {} points of opaque things, {cameras} cameras", count(points as u64))
        });
        let file = format!("file: {} (world coordinates of the dataset)", self.file.display());
        let up = self.up.map(|[x, y, z]| {
            let note = self.up_note.as_deref().unwrap_or("the mean of the cameras");
            format!("up: ({x:.3}, {y:.3}, {z:.3}), which the root node turns to +y; {note}")
        });
        lines.chain(around).chain([file]).chain(up).collect::<Vec<_>>().join("\n")
    }
}

/// Three numbers in the precision of the files.
fn narrow(v: Vec3<f64>) -> [f32; 3] {
    v.cast::<f32>().to_array()
}

/// A ball, and a hollow one beside it.
#[cfg(test)]
fn ball_and_shell() -> Vec<Numbered> {
    use refraxel_core::{Aabb, IndexGrid, LevelSet, vec3};
    let body = |center: Vec3<f32>, shell: f32, index: f32| {
        let bounds = Aabb::new(center - Vec3::splat(1.0), center + Vec3::splat(1.0));
        let distance = |x: Vec3<f32>| {
            let d = (x - center).length() - 0.5;
            if shell > 0.0 { d.abs() - shell } else { d }
        };
        let mut grid = IndexGrid::sharp(LevelSet::from_samples(bounds, [33; 3], distance), index);
        grid.set_absorption(if shell > 0.0 { [0.2, 1.6, 6.0] } else { [0.0; 3] });
        Surface::of(&grid, 1).unwrap()
    };
    vec![
        Numbered { region: 1, surface: body(Vec3::zero(), 0.0, 1.5) },
        Numbered { region: 3, surface: body(vec3(4.0, 0.0, 0.0), 0.2, 1.33) },
    ]
}
