//! Surfaces learn: faces of polyhedra by their planes, theory (4.14), all others by the nodes of their level set, (4.18).

use super::adam::{DECAY, HALF_OF_NODES, adam, slower};
use crate::backend::IndexObjective;
use crate::blur::gaussian_blur;
use crate::model::AdamMoments;
use crate::model::polyhedron::Polyhedron;
use refraxel_core::LevelSet;

/// Adam's decays for the nodes of a surface: each is met by few rays of a step, and trembles the less the longer it remembers.
const DECAY_OF_NODES: [f32; 2] = [0.97, 0.99];
/// Steps after which the rate of planes has [halved](slower): nodes have further to go.
const HALF_OF_PLANES: f32 = 50.0;
/// Planes learn this much slower: silhouettes show them to a tenth of a voxel, and what is seen through them is blurred at first.
const OF_PLANES: f32 = 0.125;

/// One step of a surface along dLoss/dφ, unless it is held fixed. Where it is that of a `solid`, planes move. False when a moment
/// or the surface left the finite numbers.
pub(super) fn learn(
    level: &mut LevelSet<f32>,
    solid: Option<&mut Polyhedron>,
    moments: &mut AdamMoments,
    grad: &mut [f32],
    objective: &IndexObjective,
) -> bool {
    if objective.surface_rate <= 0.0 {
        return true;
    }
    if let Some(solid) = solid {
        descend_planes(level, solid, moments, grad, objective)
    } else {
        gaussian_blur(grad, level.domain().resolution, objective.surface_blur);
        descend_nodes(level, moments, grad, objective)
    }
}

/// The rate of a surface that has slowed down [scene unit].
fn rate(level: &LevelSet<f32>, slower: f32, objective: &IndexObjective) -> f32 {
    objective.surface_rate * slower * level.voxel()
}

/// Adam on the faces of a polyhedron.
fn descend_planes(
    level: &mut LevelSet<f32>,
    solid: &mut Polyhedron,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) -> bool {
    let rate = OF_PLANES * rate(level, slower(moments, HALF_OF_PLANES), objective);
    let grad = solid.vjp(level, grad);
    let which: Vec<usize> = (0..grad.len()).collect();
    let Some(steps) = adam(moments, DECAY, &which, |j| grad[j]) else { return false };
    let steps: Vec<f32> = steps.iter().map(|s| rate * s).collect();
    solid.advance(level, &steps);
    solid.put(level);
    true
}

/// Adam on φ, then a little smoothing: what one pixel wants must not become a dent.
fn descend_nodes(
    level: &mut LevelSet<f32>,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) -> bool {
    let nodes: Vec<usize> = level.parameters().filter(|&j| grad[j] != 0.0).collect();
    let slower = slower(moments, HALF_OF_NODES);
    let rate = rate(level, slower, objective);
    let Some(steps) = adam(moments, DECAY_OF_NODES, &nodes, |j| grad[j]) else { return false };
    for (&j, step) in nodes.iter().zip(steps) {
        level.coefficients_mut()[j] += rate * step;
    }
    if objective.surface_smooth > 0.0 {
        level.smooth(objective.surface_smooth * slower);
    } else {
        level.find_surface();
    }
    level.coefficients().iter().all(|c| c.is_finite()) // smoothing adds up
}
