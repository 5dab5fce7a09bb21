//! Radiance caches learn: look-ups are scattered to the probes, and these and the strengths take a step.

use super::mirrored::reads_caches;
use super::record::{CLEARCOAT, CacheLookup};
use super::tape::{Tape, sum_in_parts};
use crate::backend::{MirrorGradient, RULE, ReflectionObjective};
use crate::model::{ClearcoatMoments, MirrorMoments, MirrorSource, Reflection};
use refraxel_core::radiance::ProbeGrid;
use refraxel_core::radiance::clearcoat::{Clearcoat, ClearcoatGradient};

fn add(sums: &mut [MirrorGradient], reflection: &Reflection, lookup: &CacheLookup) {
    sums[usize::from(lookup.surface)].strength += f64::from(lookup.d_strength);
    let (cache, sum) = (reflection.cache(lookup.cache), &mut sums[usize::from(lookup.cache.region)]);
    let stencil = cache.stencil(lookup.x, lookup.direction);
    let side = if lookup.cache.inner { &mut sum.inner } else { &mut sum.outer };
    cache.scatter(&stencil, lookup.d_radiance, side);
}

/// The gradient of all mirrors from the look-ups of all tapes.
pub(super) fn mirror_gradients(reflection: &Reflection, tapes: &[Tape]) -> Vec<MirrorGradient> {
    let zero = || reflection.mirrors.iter().map(MirrorGradient::zero).collect::<Vec<_>>();
    let scatter = |sums: &mut Vec<MirrorGradient>, tape: &Tape| {
        let lookups = tape.lookups.iter().filter(|l| l.surface != CLEARCOAT);
        lookups.for_each(|lookup| add(sums, reflection, lookup));
    };
    sum_in_parts(tapes, zero, scatter, |total, part| {
        total.iter_mut().zip(&part).for_each(|(a, b)| a.merge(b))
    })
}

/// One step of every mirror, theory (7.10). False when a parameter left the finite numbers.
pub(super) fn update_mirrors(
    reflection: &mut Reflection,
    moments: &mut [MirrorMoments],
    tapes: &[Tape],
    objective: &ReflectionObjective,
) -> bool {
    let mut finite = true;
    let grads = mirror_gradients(reflection, tapes);
    for ((mirror, moments), grad) in reflection.mirrors.iter_mut().zip(moments).zip(&grads) {
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

/// The gradient of a clearcoat from the look-ups of all tapes; that of its probes only where they are looked at.
pub(super) fn clearcoat_gradient(
    clearcoat: &Clearcoat<f32>,
    source: MirrorSource,
    tapes: &[Tape],
) -> ClearcoatGradient<f32> {
    let zero = || ClearcoatGradient {
        strength: vec![0.0; clearcoat.strength.coefficients.len()],
        radiance: vec![0.0; clearcoat.radiance.coefficients.len()],
    };
    let scatter = |sums: &mut ClearcoatGradient<f32>, tape: &Tape| {
        for l in tape.lookups.iter().filter(|l| l.surface == CLEARCOAT) {
            clearcoat.scatter_strength(l.x, l.d_strength, &mut sums.strength);
            if reads_caches(source) {
                let stencil = clearcoat.radiance.stencil(l.x, l.direction);
                clearcoat.radiance.scatter(&stencil, l.d_radiance, &mut sums.radiance);
            }
        }
    };
    sum_in_parts(tapes, zero, scatter, |total, part| {
        total.strength.iter_mut().zip(&part.strength).for_each(|(t, p)| *t += p);
        total.radiance.iter_mut().zip(&part.radiance).for_each(|(t, p)| *t += p);
    })
}

/// Strengths of clearcoats stay this far from 0 and 1: beyond, they would learn nothing any more.
const MARGIN: f32 = 1e-3;

/// One step of a clearcoat along its gradient. False when a parameter left the finite numbers.
pub(super) fn update_clearcoat(
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
