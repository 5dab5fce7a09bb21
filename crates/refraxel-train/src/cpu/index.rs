//! The index learns: kicks are scattered to the grid, their gradient is blurred, and n takes an Adam step.

use super::tape::{Kick, Tape};
use crate::backend::IndexObjective;
use crate::initial::gaussian_blur;
use crate::refraction::Refraction;
use rayon::prelude::*;
use refraxel_core::index::priors;
use refraxel_core::{IndexGrid, Medium};

/// Arrays that kicks are scattered to side by side. Part of the arithmetic: it fixes the order of sums.
const PARTS: usize = 4;
/// Adam's decays; the first is that of the mean, the second that of the square.
const DECAY: [f32; 2] = [0.9, 0.99];
/// Floor of Adam's denominator, as a share of the largest: voxels that hardly matter must not follow noise.
const FLOOR: f32 = 0.1;
/// Steps between two looks at what is flat.
const REFRESH: u64 = 16;

/// Adam's moments of one region, and how many steps they saw.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexMoments {
    /// Mean of the gradient.
    pub first: Vec<f32>,
    /// Mean of its square.
    pub second: Vec<f32>,
    /// Steps taken.
    pub steps: u32,
}

impl IndexMoments {
    pub(super) fn zero(grid: &IndexGrid<f32>) -> Self {
        let n = grid.coefficients().len();
        Self { first: vec![0.0; n], second: vec![0.0; n], steps: 0 }
    }
}

/// dLoss/dcoefficients per region, from the kicks of all tapes, each bounded by `clip`.
pub(super) fn gradient(medium: &Medium<f32>, tapes: &[Tape], clip: f32) -> Vec<Vec<f32>> {
    let mut parts: Vec<Vec<Vec<f32>>> = tapes
        .par_chunks(tapes.len().div_ceil(PARTS).max(1))
        .map(|tapes| {
            let mut sums = medium.zero_gradient();
            for kick in tapes.iter().flat_map(|t| &t.kicks) {
                add(medium, kick, clip, &mut sums);
            }
            sums
        })
        .collect();
    let mut total = parts.pop().unwrap_or_else(|| medium.zero_gradient());
    for part in parts {
        for (total, part) in total.iter_mut().zip(part) {
            total.par_iter_mut().zip(part).for_each(|(t, p)| *t += p);
        }
    }
    total
}

fn add(medium: &Medium<f32>, kick: &Kick, clip: f32, sums: &mut [Vec<f32>]) {
    let region = kick.region as usize;
    let size = kick.d_force.length();
    let scale = if size > clip { clip / size } else { 1.0 };
    let grid = &medium.regions()[region];
    grid.scatter(kick.x, kick.d_w * scale, kick.d_force * scale, &mut sums[region]);
}

/// One step of every region.
pub(super) fn update(
    refraction: &mut Refraction,
    moments: &mut [IndexMoments],
    (tapes, rays, step): (&[Tape], usize, u64),
    objective: &IndexObjective,
) {
    let mut grads = gradient(&refraction.medium, tapes, objective.clip);
    for (region, (grad, moments)) in grads.iter_mut().zip(moments).enumerate() {
        let free = refraction.extras.get(region).map(|e| &e.free[..]).filter(|free| !free.is_empty());
        let grid = refraction.medium.region_mut(region);
        add_priors(grid, rays as f32, objective, grad);
        gaussian_blur(grad, grid.domain().resolution, objective.blur);
        descend(grid, free, moments, grad, objective);
        if step.is_multiple_of(REFRESH) {
            grid.find_flat_cells(free);
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

/// Adam on n = √(2c) at the free nodes, theory (4.12).
fn descend(
    grid: &mut IndexGrid<f32>,
    free: Option<&[bool]>,
    moments: &mut IndexMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    moments.steps += 1;
    let unbias = DECAY.map(|d| (1.0 - d.powi(moments.steps.min(1 << 20) as i32)).recip());
    let nodes: Vec<usize> = grid.parameters().filter(|&j| free.is_none_or(|f| f[j])).collect();
    let coefficients = grid.coefficients_mut();
    let mut largest = 0.0_f32;
    for &j in &nodes {
        let d_n = grad[j] * (2.0 * coefficients[j]).sqrt(); // dc/dn = n
        moments.first[j] += (1.0 - DECAY[0]) * (d_n - moments.first[j]);
        moments.second[j] += (1.0 - DECAY[1]) * (d_n * d_n - moments.second[j]);
        largest = largest.max(moments.second[j]);
    }
    let floor = FLOOR * (largest * unbias[1]).sqrt() + f32::MIN_POSITIVE;
    for &j in &nodes {
        let size = (moments.second[j] * unbias[1]).sqrt().max(floor);
        let n = (2.0 * coefficients[j]).sqrt() - objective.rate * moments.first[j] * unbias[0] / size;
        let n = n.clamp(1.0, objective.largest);
        coefficients[j] = 0.5 * n * n;
    }
}
