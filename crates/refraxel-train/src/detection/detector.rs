//! The detector at work: straight rays learn, and what they cannot explain is looked for.

use super::Hints;
use super::budget::{Budget, LEAST};
use super::evidence::Evidence;
use super::fit::{BATCH, DetectionFit, Fit};
use super::look::{Found, Looking, look};
use super::photographs::{Small, cell_edge, small};
use crate::cancel::Cancelled;
use crate::events::{Event, Observer, Task};
use crate::model::Gate;
use crate::options::Options;
use crate::plan::Plan;
use crate::rays::RaySampler;
use rayon::prelude::*;
use refraxel_core::Vec3;
use std::time::Instant;

/// Cells of all photographs together, each of which teaches, and is compared with, one ray, about.
const CELLS: u32 = 400_000;
/// Share of the time that is left to learning; the look takes the rest.
const LEARNING: f64 = 0.7;

/// What the detector knows.
#[derive(Clone, Copy)]
pub(crate) struct Detector<'a> {
    pub sampler: &'a RaySampler,
    pub plan: &'a Plan,
    pub options: &'a Options,
    pub hints: &'a Hints,
    pub budget: Budget,
}

impl Detector<'_> {
    /// Looks for what straight rays do not explain; `None` where the time was too short to learn enough.
    pub(crate) fn look(&self, observer: &mut Observer) -> Result<Option<Found>, Cancelled> {
        let start = Instant::now();
        let is_late = || self.budget.time.is_some_and(|time| start.elapsed() >= time.mul_f64(LEARNING));
        let photographs = small(self.sampler, CELLS);
        let course = DetectionFit::new(self.plan, self.options, &photographs);
        let mut fit = Fit::new(&course);
        let (mut step, steps) = (0, self.budget.rays / BATCH as u64);
        while step < steps && !is_late() {
            observer.progress(Task::Seeking, step, steps)?;
            fit.learn(&course, step, step as f64 / steps as f64);
            step += 1;
        }
        if (step as f64) < LEAST * steps as f64 {
            return Ok(None);
        }
        let found = self.found(&mut fit, &course, observer)?;
        let separation = found.separation;
        observer.tell(match &found.gate {
            Some(gate) => Event::Detected { separation, pixels: covered(&photographs, gate) },
            None => Event::NothingDetected { separation, needed: self.options.detection.separation },
        });
        Ok(Some(found))
    }

    /// What straight rays cannot explain.
    fn found(
        &self,
        fit: &mut Fit,
        course: &DetectionFit,
        observer: &mut Observer,
    ) -> Result<Found, Cancelled> {
        fit.settle(course);
        let mut evidence = Vec::with_capacity(course.photographs.len());
        for photograph in course.photographs {
            observer.cancel().check()?;
            evidence.push(Evidence::new(fit.backend(), photograph, &course.marching()));
        }
        let edge = cell_edge(self.sampler, CELLS) as f32;
        let cell_at = |x: Vec3<f32>| self.sampler.pixel_size(x) * edge;
        let how = Looking {
            bounds: self.options.refraction.local_box(self.plan.origin).unwrap_or(self.plan.finest.bounds),
            voxel: fit.voxel(),
            cell_at: &cell_at,
            needed: self.options.detection.separation,
            hints: self.hints,
        };
        look(&evidence, &how, observer.cancel())
    }
}

/// Share of all cells that show what was found.
fn covered(photographs: &[Small], gate: &Gate) -> f64 {
    let count = |view: &Small| view.rays.iter().flatten().filter(|ray| gate.admits(ray)).count();
    let inside: usize = photographs.par_iter().map(count).sum();
    let all: usize = photographs.iter().map(|view| view.rays.len()).sum();
    inside as f64 / all.max(1) as f64
}
