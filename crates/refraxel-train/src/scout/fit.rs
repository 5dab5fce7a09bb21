//! Straight rays that learn from photographs of few pixels.

use super::photographs::Small;
use crate::backend::{Backend, Batch, BrickMask, Marching};
use crate::cpu::CpuBackend;
use crate::model::Gate;
use crate::model::polyhedron::Plane;
use crate::options::Options;
use crate::plan::Plan;
use crate::random::Random;
use crate::schedule::{Moment, Progress, objective, training_marching};
use rayon::prelude::*;
use refraxel_core::{BrickMap, Domain, Extent, Ray, Vec3};
use refraxel_data::Backdrop;

/// Rays in the batch of a step.
pub(super) const BATCH: usize = 2048;
/// Nodes along the longest edge of the grid, of a box and of a contracted space, which gives half of them to the box.
const NODES: [u32; 2] = [72, 112];
/// Share of the learning in which the grid is half as fine.
const COARSE: f64 = 0.175;
/// Learning rates fall as in this part of a run: so short a learning needs most of them.
const SPAN: f64 = 0.5;
/// Cells that must not be used are drawn again this often before the ray is given up.
const REDRAWS: u64 = 16;
/// How far around what was found the field is cleared [voxel].
const CLEARED: f32 = 1.5;
/// The ground takes so much room above its plane [voxel].
const GROUND: f32 = 1.2;

/// What a fit learns from, and how.
pub(super) struct Course<'a> {
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

impl<'a> Course<'a> {
    pub(super) fn new(plan: &'a Plan, options: &Options, photographs: &'a [Small]) -> Self {
        let mut options = options.clone();
        (options.field.sh_degree, options.grid.stages) = (0, 1);
        Self { plan, options, photographs }
    }

    fn domain(&self, is_fine: bool) -> Domain<f32> {
        let finest = &self.plan.finest;
        let nodes = NODES[usize::from(finest.extent == Extent::Contracted)];
        Domain::with_longest(finest.bounds, finest.extent, if is_fine { nodes } else { nodes / 2 })
    }

    pub(super) fn marching(&self) -> Marching {
        training_marching(&self.options, self.plan.near)
    }
}

impl Fit {
    /// A fit that has learned nothing yet.
    pub(super) fn new(course: &Course) -> Self {
        let plan = Plan { finest: course.domain(false), ..course.plan.clone() };
        let backend = CpuBackend::new(plan.start(&course.options));
        let mut before = vec![0];
        for photograph in course.photographs {
            before.push(before[before.len() - 1] + photograph.cells.len() as u64);
        }
        Self { backend, random: Random::new(course.options.run.seed), before, is_fine: false }
    }

    /// One step, at some share of all learning. Cells that are not `free` teach nothing.
    pub(super) fn learn(&mut self, course: &Course, step: u64, share: f64, free: &[Vec<bool>]) {
        if !self.is_fine && share >= COARSE {
            let domain = course.domain(true);
            self.backend.resample(domain, BrickMap::dense(domain.resolution));
            self.backend.refresh_occupancy(&course.marching());
            self.is_fine = true;
        }
        let (progress, extent) = (Progress(SPAN * share), self.backend.domain().extent);
        let moment = Moment { progress, bends_since: None, bends: false, extent };
        let objective = objective(&course.options, course.plan.near, moment);
        let batch = self.batch(course, step, free);
        self.backend.submit(&batch, &objective, step);
        self.backend.outcomes(false);
    }

    fn batch(&self, course: &Course, step: u64, free: &[Vec<bool>]) -> Batch {
        let is_transparent = course.plan.backdrop == Backdrop::Transparent;
        let cells = self.before[self.before.len() - 1];
        let draw = |i: u64| {
            let (view, cell) = (0..REDRAWS).find_map(|k| {
                let at = self.random.below(cells, step, 64 * i + 8 + k);
                let view = self.before.partition_point(|before| *before <= at) - 1;
                let cell = (at - self.before[view]) as usize;
                (free.is_empty() || free[view][cell]).then_some((view, cell))
            })?;
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
    pub(super) fn settle(&mut self, course: &Course) {
        self.backend.outcomes(true);
        self.backend.refresh_occupancy(&course.marching());
    }

    /// Straight rays have filled what was found with haze: it is emptied. What it stands on stays.
    pub(super) fn clear(&mut self, course: &Course, gate: &Gate, ground: Option<&Plane>) {
        let voxel = self.backend.domain().voxel();
        let (reach, thickness) = (CLEARED * voxel, GROUND * voxel);
        let around = |x: Vec3<f32>| {
            let beside = |a: usize, by: f32| {
                let mut x = x;
                x[a] += by;
                gate.is_inside(x)
            };
            let stands = ground.is_none_or(|p| p.height(x) > thickness);
            stands && (gate.is_inside(x) || (0..3).any(|a| beside(a, reach) || beside(a, -reach)))
        };
        let inside = BrickMask::new(self.backend.domain(), self.backend.map(), around);
        self.backend.set_density(course.options.refraction.contents_density, &inside);
        self.backend.refresh_occupancy(&course.marching());
    }
}
