//! The scout: where refractive things are when no mask says so, found out before a run begins.
//!
//! Straight rays of few pixels and a coarse grid learn the scene for some seconds. What they show of a view and its photograph
//! differ most where light was bent (`look`).
//!
//! While the surroundings are known badly, haze explains a part of what is seen through glass. So there are several looks: after
//! each, what was found is cleared and straight rays learn what lies outside of it; the next look sees the photographs before
//! the scene without the thing.
//!
//! The run itself knows nothing of all this: it begins with what was found in place of masks, or as if nobody had looked.

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
use crate::events::{Event, Task, Watch};
use crate::model::Gate;
use crate::options::Options;
use crate::plan::Plan;
use crate::rays::RaySampler;
use evidence::Evidence;
use fit::{BATCH, Course, Fit};
use look::{Looking, Seen, Sought, look};
use photographs::{Small, cell_edge, small};
use rayon::prelude::*;
use refraxel_core::Vec3;
use std::time::{Duration, Instant};

/// Share of the learning before the first look.
const FIRST: f64 = 0.5;
/// Cells beside what was found from which straight rays do not learn.
const MARGIN: usize = 1;

/// What the scout knows.
#[derive(Clone, Copy)]
pub(crate) struct Scout<'a> {
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

/// Less than this part of the rays is not worth looking with.
const LEAST: f64 = 0.25;

impl Budget {
    /// What a run allows, if that is enough.
    pub(crate) fn of_run(options: &Options) -> Option<Self> {
        let (run, seek) = (&options.run, &options.seek);
        if run.minutes > 0.0 {
            let time = Duration::from_secs_f64(60.0 * run.minutes * seek.cost);
            return Some(Self { rays: seek.rays, time: Some(time) });
        }
        let most = seek.cost * run.steps as f64 * f64::from(run.batch);
        let rays = seek.rays.min(most as u64);
        (rays as f64 >= LEAST * seek.rays as f64).then_some(Self { rays, time: None })
    }

    /// All that the options ask for.
    pub(crate) fn unbounded(options: &Options) -> Self {
        Self { rays: options.seek.rays, time: None }
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

impl Scout<'_> {
    /// Looks for what straight rays do not explain; `None` where the time was too short to learn enough.
    pub(crate) fn look(&self, watch: &mut Watch) -> Result<Option<Found>, Cancelled> {
        let looks = self.options.seek.looks;
        let pace = Pace { start: Instant::now(), time: self.budget.time, looks };
        let photographs = small(self.sampler, self.options.seek.cells);
        let course = Course::new(self.plan, self.options, &photographs);
        let mut fit = Fit::new(&course);
        let steps = self.budget.rays / BATCH as u64;
        let (mut found, mut step): (Option<(Sought, f64)>, u64) = (None, 0);
        for number in 1..=looks {
            let until = (steps as f64 * share_before(number, looks)) as u64;
            let free = found.as_ref().map_or(Vec::new(), |(sought, _)| free(&photographs, &sought.gate));
            while step < until && !pace.is_late(number) {
                watch.progress(Task::Seeking, step, steps)?;
                fit.learn(&course, step, step as f64 / steps as f64, &free);
                step += 1;
            }
            if (step as f64) < LEAST * until as f64 {
                break;
            }
            let before = found.as_ref().map(|(sought, _)| &sought.gate);
            let seen = self.seen(&mut fit, &course, (number == looks, before), watch)?;
            let separation = seen.separation;
            let Some(sought) = seen.sought else {
                let needed = self.options.seek.separation;
                watch.tell(Event::NothingSought { look: number, separation, needed });
                return Ok(Some(Found { gate: None, separation }));
            };
            watch.tell(Event::Sought {
                look: number,
                separation,
                pixels: covered(&photographs, &sought.gate),
            });
            fit.clear(&course, &sought.gate, sought.ground.as_ref());
            found = Some((sought, separation));
        }
        Ok(found.map(|(sought, separation)| Found { gate: Some(sought.gate), separation }))
    }

    /// What a look sees.
    fn seen(
        &self,
        fit: &mut Fit,
        course: &Course,
        (is_last, before): (bool, Option<&Gate>),
        watch: &mut Watch,
    ) -> Result<Seen, Cancelled> {
        fit.settle(course);
        let mut evidence = Vec::with_capacity(course.photographs.len());
        for photograph in course.photographs {
            watch.cancel().check()?;
            evidence.push(Evidence::new(fit.backend(), photograph, &course.marching()));
        }
        let edge = cell_edge(self.sampler, self.options.seek.cells) as f32;
        let cell_at = |x: Vec3<f32>| self.sampler.pixel_size(x) * edge;
        let how = Looking {
            bounds: self.options.refraction.aabb().unwrap_or(self.plan.finest.bounds),
            voxel: fit.voxel(),
            cell_at: &cell_at,
            needed: self.options.seek.separation,
            hints: self.hints,
            is_last,
            before,
        };
        look(&evidence, &how, watch.cancel())
    }
}

/// When learning must give way to a look, where there is a clock.
struct Pace {
    start: Instant,
    time: Option<Duration>,
    looks: u32,
}

/// Share of the time that is left to learning; looks take the rest.
const LEARNING: f64 = 0.7;

impl Pace {
    /// The learning before a look has had its time.
    fn is_late(&self, number: u32) -> bool {
        let looked = f64::from(number - 1) / f64::from(self.looks) * (1.0 - LEARNING);
        let share = LEARNING * share_before(number, self.looks) + looked;
        self.time.is_some_and(|time| self.start.elapsed() >= time.mul_f64(share))
    }
}

/// Share of all learning before a look.
fn share_before(number: u32, looks: u32) -> f64 {
    let later = f64::from(number - 1) / f64::from(looks.max(2) - 1);
    FIRST + (1.0 - FIRST) * later
}

/// Which cells of each photograph show nothing of what was found, also not beside them.
fn free(photographs: &[Small], gate: &Gate) -> Vec<Vec<bool>> {
    let of = |view: &Small| {
        let [width, height] = view.size();
        let covered: Vec<bool> =
            view.rays.iter().map(|ray| ray.is_some_and(|ray| gate.admits(&ray))).collect();
        let is_free = |cell: usize| {
            let (x, y) = (cell % width, cell / width);
            let columns = x.saturating_sub(MARGIN)..(x + MARGIN + 1).min(width);
            let mut rows = y.saturating_sub(MARGIN)..(y + MARGIN + 1).min(height);
            rows.all(|y| !covered[y * width..][columns.clone()].contains(&true))
        };
        (0..covered.len()).map(is_free).collect()
    };
    photographs.par_iter().map(of).collect()
}

/// Share of all cells that show what was found.
fn covered(photographs: &[Small], gate: &Gate) -> f64 {
    let count = |view: &Small| view.rays.iter().flatten().filter(|ray| gate.admits(ray)).count();
    let inside: usize = photographs.par_iter().map(count).sum();
    let all: usize = photographs.iter().map(|view| view.rays.len()).sum();
    inside as f64 / all.max(1) as f64
}
