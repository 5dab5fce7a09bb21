//! The run that writes a dataset.

use super::super::cameras::{CameraSet, opengl_matrix};
use super::super::dataset::{ANGLE, Cost, DatasetOptions, Part, ViewCounts, background_of};
use super::super::error::SynthError;
use super::super::render::{Frame, Sampling, refracts, render_view};
use super::super::scene::{Environment, Scene};
use super::super::scenes::{SceneOptions, scene};
use super::super::shape::TriangleMesh;
use super::super::trace::{Limits, Reflection};
use super::super::truth::{IndexTruth, opaque_json, refractive_json};
use super::files::{create_folder, io, write_whole};
use super::manifest::{Manifest, State, prepare};
use super::npz::npz_of_index;
use super::pictures::{
    DEPTH_UNIT, color_png, depth_png, linear_exr, mask_picture, mask_png, normal_picture, normal_png, sheet,
};
use crate::image::Image;
use rayon::prelude::*;
use refraxel_core::Camera;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Instant;

/// What `refraxel synth` is asked for.
#[derive(Clone, Debug)]
pub struct SynthOptions {
    /// Name of the scene, see [`super::super::scene_list`].
    pub scene: String,
    /// Folder of the dataset; created when missing.
    pub out: PathBuf,
    /// Edge of the square pictures [pixel].
    pub size: u32,
    /// Views per split.
    pub views: ViewCounts,
    /// Choice of textures, cameras and jitter.
    pub seed: u64,
    /// Index of the main refractive body; `None`: the scene's default.
    pub ior: Option<f64>,
    /// Whether interfaces reflect.
    pub reflection: Reflection,
    /// From where the scene is seen.
    pub cameras: CameraSet,
    /// Samples per pixel, rounded up to a square number.
    pub spp: u32,
    /// Samples per pixel where the first ones differ; 0 or at most `spp`: none.
    pub detail_spp: u32,
    /// Also write linear float pictures.
    pub exr: bool,
    /// Cells along the longest edge of the index field; 0: no field.
    pub index_resolution: u32,
    /// Wavefront OBJ file whose mesh takes the place of the knot in `glass_mesh`.
    pub mesh: Option<PathBuf>,
    /// Threads; `None`: those of the current rayon pool.
    pub threads: Option<usize>,
}

impl SynthOptions {
    /// The usual dataset of a scene: 100 + 10 + 40 views of 200² from the upper hemisphere.
    pub fn new(scene: &str, out: impl Into<PathBuf>) -> SynthOptions {
        SynthOptions {
            scene: scene.into(),
            out: out.into(),
            size: 200,
            views: ViewCounts::default(),
            seed: 0,
            ior: None,
            reflection: Reflection::On,
            cameras: CameraSet::Upper,
            spp: 16,
            detail_spp: 64,
            exr: false,
            index_resolution: 128,
            mesh: None,
            threads: None,
        }
    }

    fn dataset(&self) -> DatasetOptions {
        DatasetOptions {
            size: [self.size; 2],
            views: self.views,
            cameras: self.cameras,
            seed: self.seed,
            spp: self.spp,
            detail_spp: self.detail_spp,
            limits: Limits { reflection: self.reflection, ..Limits::default() },
            twins: true,
        }
    }

    fn check(&self) -> Result<(), SynthError> {
        let within = |option, value: u64, low: u64, high: u64| {
            let expected = format!("a whole number from {low} to {high}");
            let error = SynthError::Range { option, found: value.to_string(), expected };
            if (low..=high).contains(&value) { Ok(()) } else { Err(error) }
        };
        within("--size", self.size.into(), 1, 8192)?;
        within("--views", self.views.total() as u64, 1, 100_000)?;
        within("--spp", self.spp.into(), 1, 65_536)?;
        within("--detail-spp", self.detail_spp.into(), 0, 65_536)?;
        within("--index-resolution", self.index_resolution.into(), 0, 1024)?;
        within("--threads", self.threads.unwrap_or(1) as u64, 1, 1024)?;
        if self.mesh.is_some() && self.scene != "glass_mesh" {
            let expected = format!("nothing: only glass_mesh takes a mesh, not {}", self.scene);
            return Err(SynthError::Range { option: "--mesh", found: "a file".into(), expected });
        }
        Ok(())
    }

    fn scene(&self) -> Result<Scene, SynthError> {
        let mesh = match &self.mesh {
            None => None,
            Some(path) => {
                let text = std::fs::read_to_string(path).map_err(io("read", path))?;
                let bad = |source| SynthError::Mesh { path: path.clone(), source };
                Some(TriangleMesh::from_obj(&text).map_err(bad)?)
            }
        };
        scene(&self.scene, &SceneOptions { seed: self.seed, ior: self.ior, mesh })
    }

    /// Everything that the bytes of the pictures depend on.
    fn parameters(&self, truth: &Value) -> Value {
        let cameras = if self.cameras == CameraSet::Upper { "upper" } else { "full" };
        json!({
            "program": concat!("refraxel ", env!("CARGO_PKG_VERSION")),
            "scene": self.scene,
            "size": self.size,
            "views": [self.views.train, self.views.val, self.views.test],
            "seed": self.seed,
            "reflection": self.reflection == Reflection::On,
            "cameras": cameras,
            "spp": self.spp,
            "detail_spp": self.detail_spp,
            "exr": self.exr,
            "index_resolution": self.index_resolution,
            "bodies": truth,
        })
    }
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pictures finished, including those found from an interrupted run.
    pub done: usize,
    /// Pictures in all (twins count).
    pub total: usize,
}

/// What a run has made.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The dataset's folder.
    pub out: PathBuf,
    /// Pictures rendered by this run.
    pub rendered: usize,
    /// Pictures kept from an interrupted run.
    pub kept: usize,
    /// What rendering has cost; no samples when everything was kept.
    pub cost: Cost,
    /// Mean share of a sample's energy that ended at the depth limit.
    pub lost_energy: f64,
}

/// One picture to make.
#[derive(Clone, Copy, Debug)]
struct Job {
    part: Part,
    twin: bool,
    index: usize,
    camera: Camera,
}

struct Run<'a> {
    options: &'a SynthOptions,
    dataset: DatasetOptions,
    scene: Scene,
    twin: Option<Scene>,
}

/// Write the dataset of a scene. `progress` hears of every finished picture and may stop the run.
///
/// Files appear under their final names only when they are whole. Run again with the same options, it keeps finished
/// pictures; with other options, it replaces a dataset of its own and refuses any other. Same options, same bytes.
///
/// # Errors
/// Every variant of [`SynthError`], before anything is written where the options are at fault.
pub fn synthesize(
    options: &SynthOptions,
    progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<Summary, SynthError> {
    options.check()?;
    let scene = options.scene()?;
    let twin = refracts(&scene).then(|| scene.without_refraction());
    let run = Run { options, dataset: options.dataset(), scene, twin };
    match options.threads {
        None => run.write(progress),
        Some(threads) => rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|source| SynthError::Threads { threads, source })?
            .install(|| run.write(progress)),
    }
}

impl Run<'_> {
    fn write(&self, progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync)) -> Result<Summary, SynthError> {
        let out = &self.options.out;
        create_folder(out)?;
        let manifest = prepare(out, &self.options.parameters(&refractive_json(&self.scene)))?;
        let jobs = self.jobs();
        for folder in self.folders() {
            create_folder(&out.join(folder))?;
        }
        let missing: Vec<Job> = jobs.iter().copied().filter(|j| !self.path(j, None).exists()).collect();
        let kept = jobs.len() - missing.len();
        let start = Instant::now();
        let mut cost = self.render(&missing, Progress { done: kept, total: jobs.len() }, progress)?;
        cost.seconds = start.elapsed().as_secs_f64();
        if manifest.state != State::Complete || !missing.is_empty() {
            self.write_truth()?;
            Manifest { state: State::Complete, ..manifest }.write(out)?;
        }
        let lost_energy = if cost.samples == 0 { 0.0 } else { cost.tally.lost / cost.samples as f64 };
        Ok(Summary { out: out.clone(), rendered: missing.len(), kept, cost, lost_energy })
    }

    fn jobs(&self) -> Vec<Job> {
        let mut jobs = Vec::new();
        for part in Part::ALL {
            for (index, camera) in self.dataset.split_cameras(part).into_iter().enumerate() {
                jobs.push(Job { part, twin: false, index, camera });
                if part == Part::Test && self.twin.is_some() {
                    jobs.push(Job { part, twin: true, index, camera });
                }
            }
        }
        jobs
    }

    /// Folders that pictures go to.
    fn folders(&self) -> Vec<String> {
        let mut kinds = vec!["", "depth/", "normals/"];
        kinds.extend(self.twin.is_some().then_some("masks/"));
        kinds.extend(self.options.exr.then_some("exr/"));
        let parts = Part::ALL.into_iter().filter(|p| p.count(&self.options.views) > 0);
        let mut folders: Vec<String> =
            parts.flat_map(|p| kinds.iter().map(move |kind| format!("{kind}{}", p.folder()))).collect();
        if self.twin.is_some() && self.options.views.test > 0 {
            folders.push("test_bg".into());
        }
        folders
    }

    /// The file of a job's picture (`None`) or of its mask, depth, … under `kind`.
    fn path(&self, job: &Job, kind: Option<&str>) -> PathBuf {
        let folder = if job.twin { "test_bg" } else { job.part.folder() };
        let extension = if kind == Some("exr") { "exr" } else { "png" };
        let root = kind.map_or(self.options.out.clone(), |k| self.options.out.join(k));
        root.join(folder).join(format!("r_{}.{extension}", job.index))
    }

    fn render(
        &self,
        jobs: &[Job],
        start: Progress,
        progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
    ) -> Result<Cost, SynthError> {
        let state = Mutex::new((start, false));
        let each = |job: &Job| {
            let stopped = || {
                let (p, _) = *state.lock().unwrap_or_else(|e| e.into_inner());
                SynthError::Stopped { done: p.done, total: p.total }
            };
            if state.lock().unwrap_or_else(|e| e.into_inner()).1 {
                return Err(stopped());
            }
            let cost = self.render_one(job)?;
            let mut now = state.lock().unwrap_or_else(|e| e.into_inner());
            now.0.done += 1;
            now.1 |= progress(now.0).is_break();
            Ok(cost)
        };
        let costs: Vec<Cost> = jobs.par_iter().map(each).collect::<Result<_, SynthError>>()?;
        Ok(costs.into_iter().fold(Cost::default(), Cost::plus))
    }

    /// Render a job and write its files; the picture itself comes last and marks the job as done.
    fn render_one(&self, job: &Job) -> Result<Cost, SynthError> {
        let scene = self.twin.as_ref().filter(|_| job.twin).unwrap_or(&self.scene);
        let number = DatasetOptions::view_number(job.part, job.index);
        let frame = render_view(scene, &job.camera, number, &self.dataset.sampling());
        if !job.twin {
            self.write_buffers(job, &frame)?;
        }
        let path = self.path(job, None);
        write_whole(&path, &color_png(&path, &frame.image())?)?;
        Ok(Cost::of_frame(&frame))
    }

    fn write_buffers(&self, job: &Job, frame: &Frame) -> Result<(), SynthError> {
        let [depth, normals, masks, exr] =
            ["depth", "normals", "masks", "exr"].map(|k| self.path(job, Some(k)));
        write_whole(&depth, &depth_png(&depth, frame)?)?;
        write_whole(&normals, &normal_png(&normals, frame)?)?;
        if self.twin.is_some() {
            write_whole(&masks, &mask_png(&masks, &frame.mask())?)?;
        }
        if self.options.exr {
            write_whole(&exr, &linear_exr(&exr, frame)?)?;
        }
        Ok(())
    }

    /// Everything but the pictures; `transforms_*.json` last, so that only whole datasets have them.
    fn write_truth(&self) -> Result<(), SynthError> {
        let out = &self.options.out;
        let mut scene = self.scene_json();
        if let Some(truth) = IndexTruth::of_scene(&self.scene).filter(|_| self.options.index_resolution > 0) {
            scene["index_field"] = self.write_index(&truth)?;
        }
        write_json(&out.join("scene.json"), &scene)?;
        let path = out.join("contact.png");
        let cameras = self.dataset.split_cameras(Part::Test);
        write_whole(
            &path,
            &color_png(&path, &contact_sheet(&self.scene, &cameras, &self.dataset.sampling()))?,
        )?;
        for part in Part::ALL.into_iter().filter(|p| p.count(&self.options.views) > 0) {
            let name = part.folder();
            write_json(&out.join(format!("transforms_{name}.json")), &self.transforms(part, name))?;
        }
        if self.twin.is_some() && self.options.views.test > 0 {
            write_json(&out.join("transforms_test_bg.json"), &self.transforms(Part::Test, "test_bg"))?;
        }
        Ok(())
    }

    fn write_index(&self, truth: &IndexTruth) -> Result<Value, SynthError> {
        let (bounds, longest) = (self.scene.bounds, self.options.index_resolution);
        let e = bounds.extent();
        let cells =
            e.to_array().map(|l| ((l / e.max_element() * f64::from(longest)).round() as usize).max(1));
        let n = truth.voxels(&bounds, cells);
        let bytes = npz_of_index(&bounds, cells, &n);
        write_whole(&self.options.out.join("index.npz"), &bytes)?;
        Ok(json!({
            "file": "index.npz",
            "cells": cells,
            "layout": "n[x, y, z] float32 at cell centres min + (i + 1/2) (max - min) / cells; z runs fastest",
        }))
    }

    fn transforms(&self, part: Part, folder: &str) -> Value {
        let frame = |(i, camera): (usize, &Camera)| json!({ "file_path": format!("./{folder}/r_{i}"), "transform_matrix": opengl_matrix(camera) });
        let frames: Vec<Value> = self.dataset.split_cameras(part).iter().enumerate().map(frame).collect();
        let size = self.options.size;
        let mut all = json!({ "camera_angle_x": ANGLE, "w": size, "h": size });
        if let Some(background) = background_of(&self.scene) {
            all["background"] = json!(background);
        }
        all["frames"] = Value::Array(frames);
        all
    }

    fn scene_json(&self) -> Value {
        let (o, b) = (self.options, self.scene.bounds);
        let linear = match self.scene.environment {
            Environment::Constant(c) => json!(c),
            Environment::Sky { .. } => Value::Null,
        };
        json!({
            "name": self.scene.name,
            "note": self.scene.shows,
            "renderer": concat!("refraxel ", env!("CARGO_PKG_VERSION"), " exact tracer, float64"),
            "resolution": [o.size, o.size],
            "spp": o.spp,
            "detail_spp": o.detail_spp,
            "seed": o.seed,
            "reflection": if o.reflection == Reflection::On { "fresnel" } else { "off" },
            "energy_cut": self.dataset.limits.energy_cut,
            "camera_angle_x": ANGLE,
            "pixel_filter": "box, averaged in linear light then sRGB-encoded",
            "up_axis": "z",
            "near": 2.0,
            "far": 6.5,
            "aabb": [b.min.to_array(), b.max.to_array()],
            "image_mode": "RGB",
            "background_srgb8": background_of(&self.scene),
            "background_linear": linear,
            "lighting": "emissive textures only (opaque surfaces without glaze_ior look the same from everywhere); colours are basic radiance L/n^2",
            "refractive": refractive_json(&self.scene),
            "opaque": opaque_json(&self.scene),
            "files": {
                "masks": "8-bit coverage (0..255) of the refractive object as first thing seen",
                "test_bg": "same cameras as test, refractive objects removed",
                "depth": format!("16-bit, {DEPTH_UNIT} scene units along the optical axis at the pixel centre, 0 = background"),
                "normals": "16-bit, 65535 (n + 1) / 2, world axes, facing the camera, 0 = background",
            },
        })
    }
}

fn write_json(path: &Path, value: &Value) -> Result<(), SynthError> {
    // Serialising a Value cannot fail: its keys are strings and its numbers finite.
    let text = serde_json::to_string_pretty(value).unwrap_or_default();
    write_whole(path, text.as_bytes())
}

/// A few views of a scene for people: pictures, twins without refraction, masks and normals, one row each.
pub fn contact_sheet(scene: &Scene, cameras: &[Camera], sampling: &Sampling) -> Image {
    const COLUMNS: usize = 5;
    const EDGE: u32 = 240; // pixel
    let twin = scene.without_refraction();
    let mut rows = vec![Vec::new(); 4];
    for (i, camera) in cameras.iter().take(COLUMNS).enumerate() {
        let camera = camera.resized(EDGE, EDGE * camera.height / camera.width);
        let frame = render_view(scene, &camera, i as u64, sampling);
        rows[0].push(frame.image());
        rows[1].push(render_view(&twin, &camera, i as u64, sampling).image());
        rows[2].push(mask_picture(&frame.mask()));
        rows[3].push(normal_picture(&frame));
    }
    sheet(&rows, 4)
}
