//! Mirrors learn: lookups of the caches are scattered to their probes, and these and the strengths take a step.

use super::clearcoat::CLEARCOAT;
use super::tape::{CacheLookup, Tape, sum_in_parts};
use super::update::RULE;
use crate::backend::ReflectionObjective;
use crate::reflection::{Mirror, Reflection};
use refraxel_core::radiance::ProbeGrid;

/// Second moments of one mirror.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MirrorMoments {
    /// Of its strength.
    pub strength: f32,
    /// One per probe of the outer cache.
    pub outer: Vec<f32>,
    /// One per probe of the inner cache.
    pub inner: Vec<f32>,
}

/// dLoss/d(everything) of one mirror.
#[derive(Clone, Debug, PartialEq)]
pub struct MirrorGradient {
    /// With respect to ρ.
    pub strength: f64,
    /// With respect to the coefficients of the outer cache.
    pub outer: Vec<f32>,
    /// With respect to the coefficients of the inner cache.
    pub inner: Vec<f32>,
}

impl MirrorMoments {
    /// Those of a mirror that has not learned yet.
    pub fn zero(mirror: &Mirror) -> Self {
        Self {
            strength: 0.0,
            outer: vec![0.0; mirror.outer.probes()],
            inner: vec![0.0; mirror.inner.probes()],
        }
    }
}

impl MirrorGradient {
    fn zero(mirror: &Mirror) -> Self {
        let zeros = |grid: &ProbeGrid<f32>| vec![0.0; grid.coefficients.len()];
        Self { strength: 0.0, outer: zeros(&mirror.outer), inner: zeros(&mirror.inner) }
    }

    fn add(&mut self, mirror: &Mirror, lookup: &CacheLookup) {
        self.strength += f64::from(lookup.d_strength);
        let cache = mirror.cache(lookup.inner);
        let stencil = cache.stencil(lookup.x, lookup.direction);
        cache.scatter(
            &stencil,
            lookup.d_radiance,
            if lookup.inner { &mut self.inner } else { &mut self.outer },
        );
    }

    fn merge(&mut self, other: &Self) {
        self.strength += other.strength;
        let pairs = self.outer.iter_mut().chain(&mut self.inner).zip(other.outer.iter().chain(&other.inner));
        pairs.for_each(|(a, b)| *a += b);
    }
}

/// The gradient of all mirrors from the lookups of all tapes.
pub(super) fn gradient(reflection: &Reflection, tapes: &[Tape]) -> Vec<MirrorGradient> {
    let zero = || reflection.mirrors.iter().map(MirrorGradient::zero).collect::<Vec<_>>();
    let add = |sums: &mut Vec<MirrorGradient>, tape: &Tape| {
        for lookup in tape.lookups.iter().filter(|q| q.region != u32::from(CLEARCOAT)) {
            let region = lookup.region as usize;
            sums[region].add(&reflection.mirrors[region], lookup);
        }
    };
    sum_in_parts(tapes, zero, add, |total, part| total.iter_mut().zip(&part).for_each(|(a, b)| a.merge(b)))
}

/// One step of every mirror, theory (7.10).
pub(super) fn update(
    reflection: &mut Reflection,
    moments: &mut [MirrorMoments],
    tapes: &[Tape],
    objective: &ReflectionObjective,
) {
    let grads = gradient(reflection, tapes);
    for ((mirror, moments), grad) in reflection.mirrors.iter_mut().zip(moments).zip(&grads) {
        if grad.strength != 0.0 {
            let step = RULE.step(grad.strength as f32, &mut moments.strength, objective.rate_strength);
            mirror.strength = (mirror.strength + step).clamp(0.0, 1.0);
        }
        descend(&mut mirror.outer, &mut moments.outer, &grad.outer, objective.rate);
        descend(&mut mirror.inner, &mut moments.inner, &grad.inner, objective.rate);
    }
}

/// RMSProp with one second moment per probe, as for the colours of voxels.
pub(super) fn descend(cache: &mut ProbeGrid<f32>, moments: &mut [f32], grad: &[f32], rate: f32) {
    let stride = cache.stride();
    let probes = cache.coefficients.chunks_exact_mut(stride).zip(grad.chunks_exact(stride)).zip(moments);
    for ((coefficients, grad), moment) in probes {
        let square = grad.iter().map(|g| g * g).sum::<f32>() / stride as f32;
        if square > 0.0 && rate > 0.0 {
            let scale = RULE.scale(square, moment, rate);
            coefficients.iter_mut().zip(grad).for_each(|(c, g)| *c += scale * g);
        }
    }
}
