//! Exact renderings with everything that is known of them.

use super::plan::Plan;
use crate::part::Part;
use crate::synth::dataset::{Cost, DatasetOptions, PlannedView};
use crate::synth::error::SynthError;
use crate::synth::output::files::write_whole;
use crate::synth::output::options::SynthOptions;
use crate::synth::output::pictures::{color_png, depth_png, linear_exr, mask_png, normal_png};
use crate::synth::render::{Frame, refracts, render_view};
use crate::synth::scene::Scene;
use serde_json::Value;
use std::path::PathBuf;

/// One picture to make.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job {
    view: PlannedView,
    /// True for the picture without everything refractive.
    twin: bool,
}

pub(super) struct Renderings<'a> {
    pub(super) options: &'a SynthOptions,
    pub(super) dataset: DatasetOptions,
    pub(super) scene: Scene,
    /// The scene without everything refractive, where something is refractive.
    pub(super) twin: Option<Scene>,
}

impl<'a> Renderings<'a> {
    pub(super) fn new(options: &'a SynthOptions) -> Result<Self, SynthError> {
        let scene = options.scene()?;
        let twin = refracts(&scene).then(|| scene.without_refraction());
        Ok(Renderings { options, dataset: options.dataset(), scene, twin })
    }

    /// The file of a job's picture (`None`) or of its mask, depth, … under `kind`.
    fn file(&self, job: &Job, kind: Option<&str>) -> PathBuf {
        let folder = if job.twin { "test_bg" } else { job.view.part.name() };
        let extension = if kind == Some("exr") { "exr" } else { "png" };
        let root = kind.map_or(self.options.out.clone(), |k| self.options.out.join(k));
        root.join(folder).join(format!("r_{}.{extension}", job.view.index))
    }

    fn write_buffers(&self, job: &Job, frame: &Frame) -> Result<(), SynthError> {
        let [depth, normals, masks, exr] =
            ["depth", "normals", "masks", "exr"].map(|k| self.file(job, Some(k)));
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

impl Plan for Renderings<'_> {
    type Job = Job;

    fn parameters(&self) -> Value {
        self.options.parameters(&self.scene)
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

    fn folders(&self) -> Vec<String> {
        let mut kinds = vec!["", "depth/", "normals/"];
        kinds.extend(self.twin.is_some().then_some("masks/"));
        kinds.extend(self.options.exr.then_some("exr/"));
        let parts = self.options.views.parts();
        let mut folders: Vec<String> =
            parts.flat_map(|p| kinds.iter().map(move |kind| format!("{kind}{}", p.name()))).collect();
        if self.twin.is_some() && self.options.views.test > 0 {
            folders.push("test_bg".into());
        }
        folders
    }

    fn picture(&self, job: &Job) -> PathBuf {
        self.file(job, None)
    }

    fn render_one(&self, job: &Job) -> Result<Cost, SynthError> {
        let scene = self.twin.as_ref().filter(|_| job.twin).unwrap_or(&self.scene);
        let frame = render_view(scene, &job.view.camera, job.view.number(), &self.dataset.sampling);
        if !job.twin {
            self.write_buffers(job, &frame)?;
        }
        let path = self.picture(job);
        write_whole(&path, &color_png(&path, &frame.image())?)?;
        Ok(Cost::of_frame(&frame))
    }

    fn write_truth(&self) -> Result<(), SynthError> {
        self.describe()
    }
}
