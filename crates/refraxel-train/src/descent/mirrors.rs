//! Radiance caches and the strengths of mirrors and clearcoats.

use crate::backend::{MirrorGradient, RULE, ReflectionObjective};
use crate::model::{ClearcoatMoments, MirrorMoments, Reflection};
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::radiance::clearcoat::{Clearcoat, ClearcoatGradient};

/// One step of every mirror, theory (7.10). False when a parameter left the finite numbers.
pub fn update_mirrors(
    reflection: &mut Reflection,
    moments: &mut [MirrorMoments],
    gradients: &[MirrorGradient],
    objective: &ReflectionObjective,
) -> bool {
    let mut finite = true;
    for ((mirror, moments), grad) in reflection.mirrors.iter_mut().zip(moments).zip(gradients) {
        if grad.strength != 0.0 {
            let step = RULE.step(grad.strength as f32, &mut moments.strength, objective.rate_strength);
            finite &= step.is_finite();
            mirror.strength = (mirror.strength + step).clamp(0.0, 1.0);
        }
        finite &= descend(&mut mirror.outer, &mut moments.outer, &grad.outer, objective.rate);
        finite &= descend(&mut mirror.inner, &mut moments.inner, &grad.inner, objective.rate);
    }
    finite
}

/// Strengths of clearcoats stay this far from 0 and 1: beyond, they would learn nothing any more.
const MARGIN: f32 = 1e-3;

/// One step of a clearcoat along its gradient. False when a parameter left the finite numbers.
pub fn update_clearcoat(
    clearcoat: &mut Clearcoat<f32>,
    moments: &mut ClearcoatMoments,
    grad: &ClearcoatGradient<f32>,
    objective: &ReflectionObjective,
) -> bool {
    let mut finite =
        descend(&mut clearcoat.strength, &mut moments.strength, &grad.strength, objective.rate_clearcoat);
    clearcoat.bound_strength(MARGIN);
    finite &= descend(&mut clearcoat.radiance, &mut moments.radiance, &grad.radiance, objective.rate);
    finite
}

/// RMSProp with one second moment per probe, as for the colours of voxels. False when a coefficient left the finite numbers.
fn descend(cache: &mut ProbeGrid<f32>, moments: &mut [f32], grad: &[f32], rate: f32) -> bool {
    let stride = cache.stride();
    let mut finite = true;
    let probes = cache.coefficients.chunks_exact_mut(stride).zip(grad.chunks_exact(stride)).zip(moments);
    for ((coefficients, grad), moment) in probes {
        let square = grad.iter().map(|g| g * g).sum::<f32>() / stride as f32;
        // Not `square > 0`: what is no number must not pass for a probe that nobody looked at.
        if square != 0.0 && rate > 0.0 {
            let scale = RULE.scale(square, moment, rate);
            for (c, g) in coefficients.iter_mut().zip(grad) {
                *c += scale * g;
                finite &= c.is_finite();
            }
        }
    }
    finite
}
