//! The run that writes a dataset.

mod description;

use super::files::{create_folder, write_whole};
use super::manifest::{Manifest, State, prepare};
use super::options::SynthOptions;
use super::pictures::{color_png, depth_png, linear_exr, mask_png, normal_png};
use crate::synth::dataset::{Cost, DatasetOptions, Part, PlannedView};
use crate::synth::error::SynthError;
use crate::synth::render::{Frame, refracts, render_view};
use crate::synth::scene::Scene;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;

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
    view: PlannedView,
    /// True for the picture without everything refractive.
    twin: bool,
}

struct Run<'a> {
    options: &'a SynthOptions,
    dataset: DatasetOptions,
    scene: Scene,
    /// The scene without everything refractive, where something is refractive.
    twin: Option<Scene>,
}

/// How far the threads of a run are.
#[derive(Clone, Copy, Debug)]
struct Status {
    progress: Progress,
    is_stopped: bool,
}

/// Writes the dataset of a scene. `progress` is called after every finished picture and may stop the run.
///
/// Files appear under their final names only when they are whole. A second run with the same options keeps finished
/// pictures; with other options, it replaces a dataset that this program made and refuses any other. The same options
/// give the same bytes.
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
        let manifest = prepare(out, &self.options.parameters(&self.scene))?;
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
        for view in self.dataset.planned_views(&self.scene) {
            jobs.push(Job { view, twin: false });
            if view.part == Part::Test && self.twin.is_some() {
                jobs.push(Job { view, twin: true });
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
        let folder = if job.twin { "test_bg" } else { job.view.part.folder() };
        let extension = if kind == Some("exr") { "exr" } else { "png" };
        let root = kind.map_or(self.options.out.clone(), |k| self.options.out.join(k));
        root.join(folder).join(format!("r_{}.{extension}", job.view.index))
    }

    fn render(
        &self,
        jobs: &[Job],
        start: Progress,
        progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
    ) -> Result<Cost, SynthError> {
        let status = Mutex::new(Status { progress: start, is_stopped: false });
        let lock = || status.lock().unwrap_or_else(|e| e.into_inner());
        let each = |job: &Job| {
            let Status { progress: before, is_stopped } = *lock();
            if is_stopped {
                return Err(SynthError::Stopped { done: before.done, total: before.total });
            }
            let cost = self.render_one(job)?;
            let mut now = lock();
            now.progress.done += 1;
            now.is_stopped |= progress(now.progress).is_break();
            Ok(cost)
        };
        let costs: Vec<Cost> = jobs.par_iter().map(each).collect::<Result<_, SynthError>>()?;
        Ok(costs.into_iter().fold(Cost::default(), Cost::plus))
    }

    /// Renders a job and writes its files; the picture itself comes last and marks the job as done.
    fn render_one(&self, job: &Job) -> Result<Cost, SynthError> {
        let scene = self.twin.as_ref().filter(|_| job.twin).unwrap_or(&self.scene);
        let frame = render_view(scene, &job.view.camera, job.view.number(), &self.dataset.sampling());
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
}
