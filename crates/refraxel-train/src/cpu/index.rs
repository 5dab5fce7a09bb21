//! The index and its surfaces learn: kicks are scattered to the grids, their gradients are blurred, and Adam takes a step.

use super::tape::{Kick, Tape};
use crate::backend::IndexObjective;
use crate::initial::gaussian_blur;
use crate::refraction::{Extras, Refraction};
use rayon::prelude::*;
use refraxel_core::index::{MediumGradient, priors};
use refraxel_core::{IndexGrid, LevelSet, Medium};

/// Arrays that kicks are scattered to side by side. Part of the arithmetic: it fixes the order of sums.
const PARTS: usize = 4;
/// Adam's decays: of the mean, and of the mean square.
const DECAY: [f32; 2] = [0.9, 0.99];
/// Floor of Adam's denominator, as a share of the largest: voxels that hardly matter must not follow noise.
const FLOOR: f32 = 0.1;
/// Steps between two looks at what is flat.
const REFRESH: u64 = 16;

/// Adam's moments of one array of parameters, and how many steps they saw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdamMoments {
    /// Mean of the gradient.
    pub first: Vec<f32>,
    /// Mean of its square.
    pub second: Vec<f32>,
    /// Steps taken.
    pub steps: u32,
}

/// The moments of one region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndexMoments {
    /// Of the coefficients of w.
    pub index: AdamMoments,
    /// Of the coefficients of φ; empty without a surface.
    pub surface: AdamMoments,
}

impl AdamMoments {
    fn zero(n: usize) -> Self {
        Self { first: vec![0.0; n], second: vec![0.0; n], steps: 0 }
    }

    /// The change of each of the parameters `which`, for a learning rate of 1.
    fn steps(&mut self, which: &[usize], grad: impl Fn(usize) -> f32) -> Vec<f32> {
        self.steps += 1;
        let unbias = DECAY.map(|d| (1.0 - d.powi(self.steps.min(1 << 20) as i32)).recip());
        let mut largest = 0.0_f32;
        for &j in which {
            let g = grad(j);
            self.first[j] += (1.0 - DECAY[0]) * (g - self.first[j]);
            self.second[j] += (1.0 - DECAY[1]) * (g * g - self.second[j]);
            largest = largest.max(self.second[j]);
        }
        let floor = FLOOR * (largest * unbias[1]).sqrt() + f32::MIN_POSITIVE;
        let step = |&j: &usize| -self.first[j] * unbias[0] / (self.second[j] * unbias[1]).sqrt().max(floor);
        which.iter().map(step).collect()
    }
}

impl IndexMoments {
    pub(super) fn zero(grid: &IndexGrid<f32>) -> Self {
        let surface = grid.level_set().map_or(0, |l| l.coefficients().len());
        Self { index: AdamMoments::zero(grid.coefficients().len()), surface: AdamMoments::zero(surface) }
    }
}

/// dLoss/dcoefficients from the kicks of all tapes, each bounded by `clip`.
pub(super) fn gradient(medium: &Medium<f32>, tapes: &[Tape], clip: f32) -> MediumGradient<f32> {
    let parts: Vec<MediumGradient<f32>> = tapes
        .par_chunks(tapes.len().div_ceil(PARTS).max(1))
        .map(|tapes| {
            let mut sums = medium.zero_gradient();
            tapes.iter().flat_map(|t| &t.kicks).for_each(|kick| add(medium, kick, clip, &mut sums));
            sums
        })
        .collect();
    let mut parts = parts.into_iter();
    let mut total = parts.next().unwrap_or_else(|| medium.zero_gradient());
    for part in parts {
        let arrays = total.index.iter_mut().chain(&mut total.level_set);
        for (total, part) in arrays.zip(part.index.iter().chain(&part.level_set)) {
            total.par_iter_mut().zip(part).for_each(|(t, p)| *t += p);
        }
    }
    total
}

fn add(medium: &Medium<f32>, kick: &Kick, clip: f32, sums: &mut MediumGradient<f32>) {
    let (region, (d_value, d_gradient)) = (kick.region as usize, kick.d);
    let size = d_gradient.length();
    let scale = if size > clip { clip / size } else { 1.0 };
    let (d_value, d_gradient) = (d_value * scale, d_gradient * scale);
    let grid = &medium.regions()[region];
    match grid.level_set().filter(|_| kick.surface) {
        Some(level) => level.scatter(kick.x, d_value, d_gradient, &mut sums.level_set[region]),
        None => grid.scatter(kick.x, d_value, d_gradient, &mut sums.index[region]),
    }
}

/// One step of every region.
pub(super) fn update(
    refraction: &mut Refraction,
    moments: &mut [IndexMoments],
    (tapes, rays, step): (&[Tape], usize, u64),
    objective: &IndexObjective,
) {
    let grads = gradient(&refraction.medium, tapes, objective.clip);
    let arrays = grads.index.into_iter().zip(grads.level_set);
    for (region, ((mut grad, mut surface), moments)) in arrays.zip(moments).enumerate() {
        let extras = refraction.extras.get(region);
        let (free, searched) = (extras.and_then(Extras::free), extras.and_then(|e| e.searched));
        let grid = refraction.medium.region_mut(region);
        if let Some(level) = grid.level_set_mut() {
            gaussian_blur(&mut surface, level.domain().resolution, objective.surface_blur);
            descend_surface(level, &mut moments.surface, &surface, objective);
        }
        if let (Some(n), Some(_)) = (grid.interior_index(), grid.level_set()) {
            descend_one(grid, (n, searched), &mut moments.index, &grad, objective);
        } else {
            add_priors(grid, rays as f32, objective, &mut grad);
            gaussian_blur(&mut grad, grid.domain().resolution, objective.blur);
            descend(grid, free, &mut moments.index, &grad, objective);
            if step.is_multiple_of(REFRESH) {
                grid.find_flat_cells(free);
            }
        }
    }
}

/// Priors count per ray, like the loss.
fn add_priors(grid: &IndexGrid<f32>, rays: f32, objective: &IndexObjective, grad: &mut [f32]) {
    let (weight, penalty) = objective.variation;
    if weight > 0.0 {
        priors::variation_vjp(grid, penalty, weight * rays, grad);
    }
    let (weight, penalty) = objective.deviation;
    if weight > 0.0 {
        priors::deviation_vjp(grid, 1.0, penalty, weight * rays, grad);
    }
}

/// Adam on n = √(2c) at the free nodes.
fn descend(
    grid: &mut IndexGrid<f32>,
    free: Option<&[bool]>,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    let nodes: Vec<usize> = grid.parameters().filter(|&j| free.is_none_or(|f| f[j])).collect();
    let coefficients = grid.coefficients_mut();
    let steps = moments.steps(&nodes, |j| grad[j] * (2.0 * coefficients[j]).sqrt()); // dc/dn = n
    for (&j, step) in nodes.iter().zip(steps) {
        let n = ((2.0 * coefficients[j]).sqrt() + objective.rate * step).clamp(1.0, objective.largest);
        coefficients[j] = 0.5 * n * n;
    }
}

/// Adam on the one index of a body; by dw = n dn its derivative is n times the sum of the coefficients'.
fn descend_one(
    grid: &mut IndexGrid<f32>,
    (n, searched): (f32, Option<f32>),
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    if objective.rate > 0.0 {
        let d_n = n * grad.iter().sum::<f32>();
        let step = moments.steps(&[0], |_| d_n)[0];
        let [low, high] =
            searched.map_or([1.0, objective.largest], |s| [s - objective.trust, s + objective.trust]);
        grid.set_interior_index((n + objective.rate * step).max(low.max(1.0)).min(high));
    }
}

/// Adam on φ, then a little smoothing: what one pixel wants must not become a dent.
fn descend_surface(
    level: &mut LevelSet<f32>,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    let nodes: Vec<usize> = level.parameters().filter(|&j| grad[j] != 0.0).collect();
    let rate = objective.surface_rate * level.voxel();
    let steps = moments.steps(&nodes, |j| grad[j]);
    for (&j, step) in nodes.iter().zip(steps) {
        level.coefficients_mut()[j] += rate * step;
    }
    if objective.surface_smooth > 0.0 {
        level.smooth(objective.surface_smooth);
    } else {
        level.find_surface();
    }
}
