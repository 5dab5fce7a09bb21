//! The detector: where refractive things are when no mask says so, found out before a run begins.
//!
//! Straight rays of few pixels and a coarse grid learn the scene for some seconds. Where light was bent, what they show of a view
//! differs from its photograph in colour and in structure (`evidence`). A place that most views see so belongs to what they cannot
//! explain (`look`).
//!
//! The run itself knows nothing of all this: it begins with what was found in place of masks, or as if nobody had looked. Whether
//! it bends rays is decided there.

mod complete;
mod evidence;
mod fit;
mod hints;
mod hull;
mod look;
mod masks;
mod photographs;
mod refine;
mod separation;
#[cfg(test)]
mod tests;

pub use hints::Hints;
pub use masks::mask;
pub(crate) use masks::masks;

use crate::cancel::Cancelled;
use crate::events::{Event, Observer, Task};
use crate::model::Gate;
use crate::options::Options;
use crate::plan::Plan;
use crate::rays::RaySampler;
use evidence::Evidence;
use fit::{BATCH, DetectionFit, Fit};
use look::{Looking, look};
use photographs::{Small, cell_edge, small};
use rayon::prelude::*;
use refraxel_core::Vec3;
use std::time::{Duration, Instant};

/// What the detector knows.
#[derive(Clone, Copy)]
pub(crate) struct Detector<'a> {
    pub sampler: &'a RaySampler,
    pub plan: &'a Plan,
    pub options: &'a Options,
    pub hints: &'a Hints,
    pub budget: Budget,
}

/// What looking may cost.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget {
    /// Rays that are learned from.
    rays: u64,
    /// Time, where the run has a clock.
    time: Option<Duration>,
}

/// Most of a run that looking may take: of its time, or of its rays where it has steps.
const COST: f64 = 0.1;
/// Cells of all photographs together, each of which teaches, and is compared with, one ray, about.
const CELLS: u32 = 400_000;
/// Rays from which straight rays learn before the look, if the run has that many to spare.
const RAYS: u64 = 1_200_000;
/// Less than this part of the rays is not worth looking with.
const LEAST: f64 = 0.25;

impl Budget {
    /// What a run allows, if that is enough.
    pub(crate) fn of_run(options: &Options) -> Option<Self> {
        let (run, all) = (&options.run, Self::unbounded(options).rays);
        if run.minutes > 0.0 {
            let time = Duration::from_secs_f64(60.0 * run.minutes * COST);
            return Some(Self { rays: all, time: Some(time) });
        }
        let is_stated = options.detection.rays > 0;
        let most = COST * run.steps as f64 * f64::from(run.batch);
        let rays = if is_stated { all } else { all.min(most as u64) };
        (rays as f64 >= LEAST * all as f64).then_some(Self { rays, time: None })
    }

    /// All that the options ask for.
    pub(crate) fn unbounded(options: &Options) -> Self {
        Self { rays: if options.detection.rays > 0 { options.detection.rays } else { RAYS }, time: None }
    }
}

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Where it is.
    pub gate: Option<Gate>,
    /// How well it separates what straight rays explain from what they do not, 0 to 1.
    pub separation: f64,
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
            bounds: self.options.refraction.aabb().unwrap_or(self.plan.finest.bounds),
            voxel: fit.voxel(),
            cell_at: &cell_at,
            needed: self.options.detection.separation,
            hints: self.hints,
        };
        look(&evidence, &how, observer.cancel())
    }
}

/// Share of the time that is left to learning; the look takes the rest.
const LEARNING: f64 = 0.7;

/// Share of all cells that show what was found.
fn covered(photographs: &[Small], gate: &Gate) -> f64 {
    let count = |view: &Small| view.rays.iter().flatten().filter(|ray| gate.admits(ray)).count();
    let inside: usize = photographs.par_iter().map(count).sum();
    let all: usize = photographs.iter().map(|view| view.rays.len()).sum();
    inside as f64 / all.max(1) as f64
}
