//! Coats of opaque things, theory (7.13)–(7.16): a glimpse before all samples of a straight ray, from the surface at which
//! it ends, and the way back to the samples.

use super::Scene;
use super::march::Sample;
use super::mirrors;
use super::reflection::Glimpse;
use super::tape::{Query, Record, TILT, Tape, sum_in_parts};
use super::trace::Arm;
use crate::backend::ReflectionObjective;
use crate::reflection::Source;
use refraxel_core::optics::{PartialReflection, PartialReflectionAdjoint};
use refraxel_core::radiance::gloss::{Facing, Gloss, GlossGradient};
use refraxel_core::{Vec3, grid::trilinear};
use std::ops::Range;

/// The region of glimpses of coats: none.
pub(super) const COAT: u16 = u16::MAX;

/// Second moments of a coat: one per probe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GlossMoments {
    /// Of its strength.
    pub strength: Vec<f32>,
    /// Of what it mirrors.
    pub radiance: Vec<f32>,
}

impl GlossMoments {
    /// Those of a coat that has not learned yet.
    pub fn zero(gloss: &Gloss<f32>) -> Self {
        Self { strength: vec![0.0; gloss.strength.probes()], radiance: vec![0.0; gloss.radiance.probes()] }
    }
}

/// Point and h ∇θ of a sample.
#[inline(always)]
fn at(scene: &Scene, s: &Sample, arms: &[Arm]) -> (Vec3<f32>, Vec3<f32>) {
    let (x, domain) = (arms[s.arm as usize].segment.at(s.t), &scene.field.domain);
    let theta_at = s.corners.map(|v| scene.field.density[v as usize]);
    (x, domain.node_vjp(x, trilinear::gradient(s.fraction, &theta_at)) * domain.voxel())
}

/// The surface at which a ray ends, by its samples of a weight of at least `least`.
fn facing(scene: &Scene, least: f32, samples: &[Sample], arms: &[Arm]) -> Option<Facing<f32>> {
    let mut sum = Facing::nothing();
    for s in samples {
        let w = s.before * s.alpha;
        if w > least {
            let (x, slope) = at(scene, s, arms);
            sum.add(w, x, slope);
        }
    }
    sum.finished()
}

/// What the coat of the surface mirrors at which a straight ray in direction `d` ends.
pub(super) fn glimpse(
    (scene, least): (&Scene, f32),
    gloss: &Gloss<f32>,
    d: Vec3<f32>,
    (samples, arms, range): (&[Sample], &[Arm], Range<usize>),
) -> Option<Glimpse> {
    let facing = facing(scene, least, &samples[range.clone()], arms)?;
    let coat = facing.coat(d, gloss.ior)?;
    let (position, direction) = (facing.position, coat.direction);
    let mirrored = match scene.reflection.source {
        Source::Exact | Source::Black => [0.0; 3],
        Source::Learned | Source::Baked => {
            gloss.radiance.radiance(&gloss.radiance.stencil(position, direction))
        }
    };
    let of = PartialReflection {
        segment: 0,
        region: COAT,
        from_inside: false,
        position,
        direction,
        normal: coat.normal,
        reflectance: coat.share,
    };
    Some(Glimpse::new(of, range.start, gloss.strength_at(position) * coat.share, mirrored))
}

/// dLoss/d(the glimpse's own) from what it has shown: dLoss/dmirrored and dLoss/dshare.
pub(super) fn adjoint(
    (gloss, source): (&Gloss<f32>, Source),
    of: &PartialReflection<f32>,
    (d_mirrored, d_share): ([f32; 3], f32),
) -> PartialReflectionAdjoint<f32> {
    let (d_x, direction) = if matches!(source, Source::Learned | Source::Baked) {
        let stencil = gloss.radiance.stencil(of.position, of.direction);
        gloss.radiance.radiance_vjp(&stencil, of.direction, d_mirrored)
    } else {
        (Vec3::zero(), Vec3::zero())
    };
    PartialReflectionAdjoint {
        position: d_x + gloss.strength_vjp(of.position, d_share * of.reflectance),
        direction,
        reflectance: d_share * gloss.strength_at(of.position),
    }
}

/// The way back to the samples of a ray: what their weights are worth, and records of their density gradients.
pub(super) fn look_back(
    (scene, least): (&Scene, f32),
    (gloss, direction): (&Gloss<f32>, Vec3<f32>),
    d: &PartialReflectionAdjoint<f32>,
    (samples, arms): (&mut [Sample], &[Arm]),
    tilts: &mut Vec<Record>,
) {
    let Some(facing) = facing(scene, least, samples, arms) else { return };
    let (mut own, _) = facing.coat_vjp(direction, gloss.ior, d.reflectance, d.direction);
    own.position = d.position;
    let domain = &scene.field.domain;
    for s in samples {
        let w = s.before * s.alpha;
        if w > least {
            let (x, slope) = at(scene, s, arms);
            s.worth = facing.worth(&own, x, slope);
            let d_node = domain.node_jvp(x, own.slope * -w) * domain.voxel();
            let (cell, fraction) = (s.cell, s.fraction);
            tilts.push(Record { cell, fraction, basis: TILT, d_theta: 1.0, d_colour: d_node.to_array() });
        }
    }
}

/// Queries of coats only.
fn of_coats(tape: &Tape) -> impl Iterator<Item = &Query> {
    tape.queries.iter().filter(|q| q.region == u32::from(COAT))
}

/// The gradient of a coat from the queries of all tapes; that of its probes only where they are looked at.
pub(super) fn gradient(gloss: &Gloss<f32>, source: Source, tapes: &[Tape]) -> GlossGradient<f32> {
    let read = matches!(source, Source::Learned | Source::Baked);
    let zero = || GlossGradient {
        strength: vec![0.0; gloss.strength.coefficients.len()],
        radiance: vec![0.0; gloss.radiance.coefficients.len()],
    };
    let add = |sums: &mut GlossGradient<f32>, tape: &Tape| {
        for q in of_coats(tape) {
            gloss.scatter_strength(q.x, q.d_strength, &mut sums.strength);
            if read {
                let stencil = gloss.radiance.stencil(q.x, q.direction);
                gloss.radiance.scatter(&stencil, q.d_radiance, &mut sums.radiance);
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

/// One step of a coat.
pub(super) fn update(
    gloss: &mut Gloss<f32>,
    moments: &mut GlossMoments,
    (source, tapes): (Source, &[Tape]),
    objective: &ReflectionObjective,
) {
    let grad = gradient(gloss, source, tapes);
    mirrors::descend(&mut gloss.strength, &mut moments.strength, &grad.strength, objective.rate_gloss);
    gloss.bound_strength(MARGIN);
    mirrors::descend(&mut gloss.radiance, &mut moments.radiance, &grad.radiance, objective.rate);
}
