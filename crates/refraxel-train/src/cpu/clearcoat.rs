//! Coats of opaque things, theory (7.13)–(7.16): a mirrored_sample before all samples of a straight ray, from the surface at which
//! it ends, and the way back to the samples.

use super::Scene;
use super::march::Sample;
use super::mirrors;
use super::reflection::MirroredSample;
use super::tape::{CacheLookup, DENSITY_GRADIENT, Record, Tape, sum_in_parts};
use super::trace::MarchedSegment;
use crate::backend::ReflectionObjective;
use crate::reflection::Source;
use refraxel_core::optics::{PartialReflection, PartialReflectionAdjoint};
use refraxel_core::radiance::clearcoat::{Clearcoat, ClearcoatGradient, Facing};
use refraxel_core::{Vec3, grid::trilinear};
use std::ops::Range;

/// The region of mirrored_samples of clearcoats: none.
pub(super) const CLEARCOAT: u16 = u16::MAX;

/// Second moments of a clearcoat: one per probe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClearcoatMoments {
    /// Of its strength.
    pub strength: Vec<f32>,
    /// Of what it mirrors.
    pub radiance: Vec<f32>,
}

impl ClearcoatMoments {
    /// Those of a clearcoat that has not learned yet.
    pub fn zero(clearcoat: &Clearcoat<f32>) -> Self {
        Self {
            strength: vec![0.0; clearcoat.strength.probes()],
            radiance: vec![0.0; clearcoat.radiance.probes()],
        }
    }
}

/// Point and h ∇θ of a sample.
#[inline(always)]
fn at(scene: &Scene, s: &Sample, marched: &[MarchedSegment]) -> (Vec3<f32>, Vec3<f32>) {
    let (x, domain) = (marched[s.segment as usize].segment.at(s.t), &scene.field.domain);
    let theta_at = s.corners.map(|v| scene.field.density[v as usize]);
    (x, domain.node_vjp(x, trilinear::gradient(s.fraction, &theta_at)) * domain.voxel())
}

/// The surface at which a ray ends, by its samples of a weight of at least `least`.
fn facing(scene: &Scene, least: f32, samples: &[Sample], marched: &[MarchedSegment]) -> Option<Facing<f32>> {
    let mut sum = Facing::nothing();
    for s in samples {
        let w = s.before * s.alpha;
        if w > least {
            let (x, slope) = at(scene, s, marched);
            sum.add(w, x, slope);
        }
    }
    sum.finished()
}

/// What the clearcoat of the surface mirrors at which a straight ray in direction `d` ends.
pub(super) fn mirrored_sample(
    (scene, least): (&Scene, f32),
    clearcoat: &Clearcoat<f32>,
    d: Vec3<f32>,
    (samples, marched, range): (&[Sample], &[MarchedSegment], Range<usize>),
) -> Option<MirroredSample> {
    let facing = facing(scene, least, &samples[range.clone()], marched)?;
    let coating = facing.reflection(d, clearcoat.ior)?;
    let (position, direction) = (facing.position, coating.direction);
    let mirrored = match scene.reflection.source {
        Source::Exact | Source::Black => [0.0; 3],
        Source::Learned | Source::Baked => {
            clearcoat.radiance.radiance(&clearcoat.radiance.stencil(position, direction))
        }
    };
    let of = PartialReflection {
        segment: 0,
        region: CLEARCOAT,
        from_inside: false,
        position,
        direction,
        normal: coating.normal,
        reflectance: coating.share,
    };
    Some(MirroredSample::new(of, range.start, clearcoat.strength_at(position) * coating.share, mirrored))
}

/// dLoss/d(the mirrored_sample's own) from what it has shown: dLoss/dmirrored and dLoss/dshare.
pub(super) fn adjoint(
    (clearcoat, source): (&Clearcoat<f32>, Source),
    of: &PartialReflection<f32>,
    (d_mirrored, d_share): ([f32; 3], f32),
) -> PartialReflectionAdjoint<f32> {
    let (d_x, direction) = if matches!(source, Source::Learned | Source::Baked) {
        let stencil = clearcoat.radiance.stencil(of.position, of.direction);
        clearcoat.radiance.radiance_vjp(&stencil, of.direction, d_mirrored)
    } else {
        (Vec3::zero(), Vec3::zero())
    };
    PartialReflectionAdjoint {
        position: d_x + clearcoat.strength_vjp(of.position, d_share * of.reflectance),
        direction,
        reflectance: d_share * clearcoat.strength_at(of.position),
    }
}

/// The way back to the samples of a ray: what their weights are d_weight, and records of their density gradients.
pub(super) fn look_back(
    (scene, least): (&Scene, f32),
    (clearcoat, direction): (&Clearcoat<f32>, Vec3<f32>),
    d: &PartialReflectionAdjoint<f32>,
    (samples, marched): (&mut [Sample], &[MarchedSegment]),
    density_gradients: &mut Vec<Record>,
) {
    let Some(facing) = facing(scene, least, samples, marched) else { return };
    let mut own = facing.reflection_vjp(direction, clearcoat.ior, d.reflectance, d.direction).facing;
    own.position = d.position;
    let domain = &scene.field.domain;
    for s in samples {
        let w = s.before * s.alpha;
        if w > least {
            let (x, slope) = at(scene, s, marched);
            s.d_weight = facing.d_weight(&own, x, slope);
            let d_node = domain.node_jvp(x, own.slope * -w) * domain.voxel();
            let (cell, fraction) = (s.cell, s.fraction);
            density_gradients.push(Record {
                cell,
                fraction,
                basis: DENSITY_GRADIENT,
                d_theta: 1.0,
                d_colour: d_node.to_array(),
            });
        }
    }
}

/// Look-ups of clearcoats only.
fn of_clearcoats(tape: &Tape) -> impl Iterator<Item = &CacheLookup> {
    tape.lookups.iter().filter(|q| q.region == u32::from(CLEARCOAT))
}

/// The gradient of a clearcoat from the lookups of all tapes; that of its probes only where they are looked at.
pub(super) fn gradient(clearcoat: &Clearcoat<f32>, source: Source, tapes: &[Tape]) -> ClearcoatGradient<f32> {
    let read = matches!(source, Source::Learned | Source::Baked);
    let zero = || ClearcoatGradient {
        strength: vec![0.0; clearcoat.strength.coefficients.len()],
        radiance: vec![0.0; clearcoat.radiance.coefficients.len()],
    };
    let add = |sums: &mut ClearcoatGradient<f32>, tape: &Tape| {
        for q in of_clearcoats(tape) {
            clearcoat.scatter_strength(q.x, q.d_strength, &mut sums.strength);
            if read {
                let stencil = clearcoat.radiance.stencil(q.x, q.direction);
                clearcoat.radiance.scatter(&stencil, q.d_radiance, &mut sums.radiance);
            }
        }
    };
    sum_in_parts(tapes, zero, add, |total, part| {
        total.strength.iter_mut().zip(&part.strength).for_each(|(t, p)| *t += p);
        total.radiance.iter_mut().zip(&part.radiance).for_each(|(t, p)| *t += p);
    })
}

/// Strengths stay this far from 0 and 1: beyond, they would learn nothing any more.
const MARGIN: f32 = 1e-3;

/// One step of a clearcoat.
pub(super) fn update(
    clearcoat: &mut Clearcoat<f32>,
    moments: &mut ClearcoatMoments,
    (source, tapes): (Source, &[Tape]),
    objective: &ReflectionObjective,
) {
    let grad = gradient(clearcoat, source, tapes);
    mirrors::descend(
        &mut clearcoat.strength,
        &mut moments.strength,
        &grad.strength,
        objective.rate_clearcoat,
    );
    clearcoat.bound_strength(MARGIN);
    mirrors::descend(&mut clearcoat.radiance, &mut moments.radiance, &grad.radiance, objective.rate);
}
