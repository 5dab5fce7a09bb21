//! Straight rays that learn from photographs of few pixels.

use super::photographs::Small;
use crate::backend::{Backend, Batch, Marching};
use crate::cpu::CpuBackend;
use crate::options::{FieldOptions, GridOptions, Options};
use crate::plan::Plan;
use crate::random::Random;
use crate::schedule::{Moment, Progress, objective, training_marching};
use rayon::prelude::*;
use refraxel_core::{BrickMap, Domain, Ray};
use refraxel_data::Backdrop;

/// Rays in the batch of a step.
pub(super) const BATCH: usize = 2048;
/// Nodes along the longest edge of the grid, of a box and of a contracted space, which gives half of them to the box.
const NODES: [u32; 2] = [72, 112];
/// Share of the learning in which the grid is half as fine.
const COARSE: f64 = 0.35;
/// Learning rates fall as in this part of a run: so short a learning needs most of them.
const SPAN: f64 = 0.25;

/// What a fit learns from, and how.
pub(super) struct DetectionFit<'a> {
    pub plan: &'a Plan,
    /// Colour does not depend on the direction, which would explain what is seen through glass.
    pub options: Options,
    pub photographs: &'a [Small],
}

/// Straight rays and what they have learned.
pub(super) struct Fit {
    backend: CpuBackend,
    random: Random,
    /// Cells before each view, and in all.
    before: Vec<u64>,
    is_fine: bool,
}

impl<'a> DetectionFit<'a> {
    pub(super) fn new(plan: &'a Plan, options: &Options, photographs: &'a [Small]) -> Self {
        // What suits a whole run of surroundings without bounds, slower and smoother, leaves a short look in fog.
        let (run, usual) = (options.run.clone(), Options::default());
        let field = FieldOptions { sh_degree: 0, ..usual.field };
        let grid = GridOptions { stages: 1, ..usual.grid };
        let options = Options { run, field, grid, ..Options::default() };
        Self { plan, options, photographs }
    }

    fn domain(&self, is_fine: bool) -> Domain<f32> {
        let finest = &self.plan.finest;
        let nodes = NODES[usize::from(finest.extent.is_unbounded())];
        Domain::with_longest(finest.bounds, finest.extent, if is_fine { nodes } else { nodes / 2 })
    }

    pub(super) fn marching(&self) -> Marching {
        training_marching(&self.options, self.plan.near)
    }
}

impl Fit {
    /// A fit that has learned nothing yet.
    pub(super) fn new(course: &DetectionFit) -> Self {
        let plan = Plan { finest: course.domain(false), ..course.plan.clone() };
        let backend = CpuBackend::new(plan.start(&course.options));
        let mut before = vec![0];
        for photograph in course.photographs {
            before.push(before[before.len() - 1] + photograph.cells.len() as u64);
        }
        Self { backend, random: Random::new(course.options.run.seed), before, is_fine: false }
    }

    /// One step, at some share of all learning.
    pub(super) fn learn(&mut self, course: &DetectionFit, step: u64, share: f64) {
        if !self.is_fine && share >= COARSE {
            let domain = course.domain(true);
            self.backend.resample(domain, BrickMap::dense(domain.resolution));
            self.backend.refresh_occupancy(&course.marching());
            self.is_fine = true;
        }
        let (progress, extent) = (Progress(SPAN * share), self.backend.domain().extent);
        let moment = Moment { progress, bends_since: None, bends: false, is_detected: false, extent };
        let objective = objective(&course.options, course.plan.near, moment);
        let batch = self.batch(course, step);
        self.backend.submit(&batch, &objective, step);
        self.backend.outcomes(false);
    }

    fn batch(&self, course: &DetectionFit, step: u64) -> Batch {
        let is_transparent = course.plan.backdrop == Backdrop::Transparent;
        let cells = self.before[self.before.len() - 1];
        let draw = |i: u64| {
            let at = self.random.below(cells, step, 64 * i + 8);
            let view = self.before.partition_point(|before| *before <= at) - 1;
            let cell = (at - self.before[view]) as usize;
            let of = &course.photographs[view];
            let ([r, g, b, alpha], ray): ([f32; 4], Ray<f32>) = (of.cells[cell]?, of.rays[cell]?);
            let uniform = |lane: u64| self.random.uniform(step, 64 * i + lane) as f32;
            let behind: [f32; 3] = [0, 1, 2].map(uniform);
            let colour = [r, g, b];
            let target = [0, 1, 2].map(|c| colour[c] + behind[c] * (1.0 - alpha));
            Some((ray, target, behind, uniform(3)))
        };
        let mut batch = Batch::default();
        let drawn: Vec<_> = (0..BATCH as u64).into_par_iter().filter_map(draw).collect();
        for (ray, target, behind, offset) in drawn {
            batch.rays.push(ray);
            batch.target.push(target);
            batch.behind.extend(is_transparent.then_some(behind));
            batch.offset.push(offset);
        }
        batch
    }

    /// What it has learned.
    pub(super) fn backend(&self) -> &CpuBackend {
        &self.backend
    }

    /// Edge of a voxel [scene unit].
    pub(super) fn voxel(&self) -> f32 {
        self.backend.domain().voxel()
    }

    /// To look at what it has learned.
    pub(super) fn settle(&mut self, course: &DetectionFit) {
        self.backend.outcomes(true);
        self.backend.refresh_occupancy(&course.marching());
    }
}
