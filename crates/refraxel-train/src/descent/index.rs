//! The index of refraction and its surfaces.

use super::adam::{DECAY, HALF_OF_NODES, adam, slower};
use super::surface;
use crate::backend::IndexObjective;
use crate::blur::gaussian_blur;
use crate::model::{AdamMoments, IndexMoments, Refraction, RegionState};
use refraxel_core::IndexGrid;
use refraxel_core::index::{MediumGradient, priors};

/// The rate of nodes by that of the one index of a body, which has the word of all rays.
const SHARE_OF_NODES: f32 = 0.5;
/// Steps between two looks at what is flat.
const REFRESH: u64 = 16;

/// What a step has learned of the index from its rays.
#[derive(Clone, Debug)]
pub struct IndexStep {
    /// dLoss/dcoefficients, the sum over all rays of the batch.
    pub gradient: MediumGradient<f32>,
    /// Rays of the batch.
    pub rays: usize,
    /// The number of the step.
    pub step: u64,
}

/// One step of every region, theory (4.18): the gradient is blurred, feels its priors, and Adam moves what it may. False when a
/// moment or a surface left the finite numbers.
pub fn update_index(
    refraction: &mut Refraction,
    moments: &mut [IndexMoments],
    learned: IndexStep,
    objective: &IndexObjective,
) -> bool {
    let mut finite = true;
    let IndexStep { gradient, rays, step } = learned;
    let arrays = gradient.index.into_iter().zip(gradient.level_set);
    for (region, ((mut grad, mut d_phi), moments)) in arrays.zip(moments).enumerate() {
        let state = refraction.states.get_mut(region);
        let (is_held, is_rigid) = state.as_ref().map_or((false, false), |s| (s.fixed_index, s.fixed_surface));
        let searched = state.as_ref().and_then(|s| s.searched);
        let solid = state.and_then(|s| s.solid.as_mut());
        let level = refraction.medium.region_mut(region).level_set_mut();
        if let Some(level) = level.filter(|_| !is_rigid) {
            finite &= surface::learn(level, solid, &mut moments.surface, &mut d_phi, objective);
        }
        if is_held {
            continue;
        }
        let trainable = refraction.states.get(region).and_then(RegionState::trainable);
        let grid = refraction.medium.region_mut(region);
        if grid.interior_index().is_some() && grid.level_set().is_some() {
            finite &= descend_one(grid, searched, &mut moments.index, &grad, objective);
            continue;
        }
        add_priors(grid, rays as f32, objective, &mut grad);
        gaussian_blur(&mut grad, grid.domain().resolution, objective.blur);
        finite &= descend(grid, trainable, &mut moments.index, &grad, objective);
        if step.is_multiple_of(REFRESH) {
            grid.find_flat_cells(trainable);
        }
    }
    finite
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

/// Adam on n = √(2c) at the trainable nodes; false when it fails.
fn descend(
    grid: &mut IndexGrid<f32>,
    trainable: Option<&[bool]>,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) -> bool {
    if objective.rate <= 0.0 {
        return true;
    }
    let nodes: Vec<usize> = grid.parameters().filter(|&j| trainable.is_none_or(|t| t[j])).collect();
    let coefficients = grid.coefficients_mut();
    let rate = SHARE_OF_NODES * objective.rate * slower(moments, HALF_OF_NODES);
    let steps = adam(moments, DECAY, &nodes, |j| grad[j] * (2.0 * coefficients[j]).sqrt()); // dc/dn = n
    let Some(steps) = steps else { return false };
    for (&j, step) in nodes.iter().zip(steps) {
        let n = ((2.0 * coefficients[j]).sqrt() + rate * step).clamp(1.0, objective.largest);
        coefficients[j] = 0.5 * n * n;
    }
    true
}

/// Adam on the one index of a body; by dw = n dn its derivative is n times the sum of the coefficients'. False when it fails.
fn descend_one(
    grid: &mut IndexGrid<f32>,
    searched: Option<f32>,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) -> bool {
    let Some(n) = grid.interior_index().filter(|_| objective.rate > 0.0) else { return true };
    let d_n = n * grad.iter().sum::<f32>();
    let Some(steps) = adam(moments, DECAY, &[0], |_| d_n) else { return false };
    let [low, high] =
        searched.map_or([1.0, objective.largest], |s| [s - objective.trust, s + objective.trust]);
    grid.set_interior_index((n + objective.rate * steps[0]).max(low.max(1.0)).min(high));
    true
}
