//! Radiance caches learn: look-ups are scattered to the probes.

use super::record::{CLEARCOAT, CacheLookup};
use super::tape::{Tape, sum_in_parts};
use crate::backend::MirrorGradient;
use crate::model::{MirrorSource, Reflection};
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
            if source.reads_caches() {
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
