//! The walk of rays through a scene: forward, a list of stages over a packet; backward, the same list reversed for each of its rays.
//! A stage and its way back (`_vjp`) stand in one file.

use super::absorption::{FilteredRay, LengthAdjoint, absorb};
use super::colour::shade;
use super::composite::{BatchLoss, Compared};
use super::march::{fade, march, march_vjp};
use super::mirror::{MirrorAdjoint, SecondaryRay, mirror, mirror_vjp};
use super::mirrored::MirroredSample;
use super::packet::{Packet, PacketRay};
use super::record::IndexSample;
use super::sample::{RaySamples, Samples};
use super::tape::Tape;
use super::trace::{BentPath, LearnsFrom, PathVjp, trace};
use super::view::View;
use crate::backend::RayGradient;
use fearless_simd::Simd;
use refraxel_core::radiance::{Filtered, SegmentAdjoint};
use refraxel_core::{Medium, Path, Ray, Vec3};

/// Per-thread memory of the way forward.
#[derive(Default)]
pub(super) struct Scratch {
    pub packet: Packet,
    second: SecondaryRay,
}

impl Scratch {
    /// What a packet of rays meets: all stages but the last, [`composite`](super::composite::composite), which takes a ray.
    #[inline(always)]
    pub(super) fn forward<S: Simd, const BLOCKS: usize>(
        &mut self,
        simd: S,
        view: &View,
        rays: &[Ray<f32>],
        offsets: &[f32],
    ) {
        let Self { packet, second } = self;
        trace(view, rays, packet);
        march(simd, view, offsets, packet);
        shade::<S, BLOCKS>(simd, view.scene, &mut packet.seen);
        mirror::<S, BLOCKS>(simd, view, rays, packet, second);
        if view.absorbing {
            absorb(&view.scene.refraction.medium, packet);
        }
    }
}

/// Per-thread memory of the way back.
#[derive(Default)]
pub(super) struct Adjoints {
    segments: Vec<SegmentAdjoint<f32>>,
    surfaces: MirrorAdjoint,
    lengths: LengthAdjoint,
}

/// One ray of a packet that learns.
pub(super) struct LearnedRay<'a> {
    /// Its number in the batch.
    pub number: usize,
    pub found: &'a PacketRay,
    pub path: &'a Path<f32>,
    pub mirrored: &'a mut [MirroredSample],
    /// The colours of its samples behind what absorbs, where something does.
    pub filtered: &'a [Filtered<f32>],
}

/// Where the way back of a ray writes to.
pub(super) struct Out<'a> {
    pub tape: &'a mut Tape,
    pub adjoints: &'a mut Adjoints,
    /// The gradient of the ray itself, where it is asked for.
    pub wanted: Option<&'a mut RayGradient>,
}

impl LearnedRay<'_> {
    /// Its weight in the loss. One that bends beside a mask counts whole: the body is wrong there, not what stands around it.
    #[inline(always)]
    fn weight(&self, BatchLoss { batch, objective, .. }: BatchLoss) -> f32 {
        let bends = self.found.bent && self.path.bends(&batch.rays[self.number]);
        if bends && !batch.is_beside(self.number) { objective.bent_weight } else { 1.0 }
    }

    /// The way back of a ray, stage by stage from the last; its squared error.
    #[inline(always)]
    pub(super) fn backward<S: Simd, const BLOCKS: usize>(
        self,
        simd: S,
        view: &View,
        batch_loss: BatchLoss,
        seen: &mut Samples,
        out: Out,
    ) -> f64 {
        let weight = self.weight(batch_loss);
        let Self { number, found, path, mirrored, filtered } = self;
        let Out { tape, adjoints: Adjoints { segments, surfaces, lengths }, wanted } = out;
        let (scene, BatchLoss { batch, objective, .. }) = (view.scene, batch_loss);
        let ray = &batch.rays[number];

        let compared =
            Compared { batch_loss, number, found, samples: seen.of(found.samples.clone()), weight };
        let d = compared.composite_vjp(scene.background, mirrored, tape);
        mirror_vjp(view, ray.direction, mirrored, found.samples.clone(), seen, surfaces);
        let (samples, first) = (seen.of(found.samples.clone()), tape.records.len());
        d.sweep(scene.layout, samples, mirrored, tape);
        let absorbs = view.absorbing && found.bent;
        if absorbs {
            let (medium, d_whole) = (&scene.refraction.medium, d.d_thickness);
            let filtered = FilteredRay { medium, path, samples, filtered, mirrored, d_whole };
            let (records, coefficients) = (&mut tape.records[first..], &mut tape.absorption);
            tape.overflows += filtered.absorb_vjp(records, coefficients, lengths);
        }
        tape.touch(first, samples.samples);
        let others = tape.records.len();
        tape.records.append(&mut surfaces.density_gradients);
        tape.touch_from(others, &scene.field.map);

        let bent = view.tracer.as_ref().filter(|_| found.bent);
        let learns_from =
            bent.map_or(LearnsFrom::NOTHING, |_| LearnsFrom::of(path, objective.index.as_ref()));
        if wanted.is_none() && (learns_from == LearnsFrom::NOTHING || objective.index.is_none()) {
            fade(&mut tape.records[first..], samples, ray.origin, objective.full_distance);
            return d.squared_error;
        }
        if learns_from.surface && batch.is_beside(number) {
            let weight = objective.index.map_or(0.0, |o| o.silhouette);
            tape.index_samples.extend(silhouette_violation(&scene.refraction.medium, path, samples, weight));
        }
        segments.clear();
        segments.resize(if bent.is_some() { path.segments.len() } else { 1 }, SegmentAdjoint::default());
        let moving = usize::from(wanted.is_none());
        march_vjp::<S, BLOCKS>(simd, scene, samples, &tape.records[first..], moving, segments);
        fade(&mut tape.records[first..], samples, ray.origin, objective.full_distance);
        let d_exit = d.background_vjp(scene.background, batch, &found.exit);
        let d_reflections = &surfaces.reflections;
        let d_lengths = if absorbs { &lengths.segments[..] } else { &[] };
        let bent = bent.map(|tracer| BentPath { tracer, path, learns_from, d_reflections, d_lengths });
        let d_ray = PathVjp { ray, d_exit, bent }.trace_vjp(segments, &mut tape.index_samples);
        if let Some(wanted) = wanted {
            let residual = d.shown.d_colour.map(|d| 0.5 * d / weight);
            *wanted = RayGradient { residual, ..d_ray };
        }
        d.squared_error
    }
}

/// What a path owes that should have missed the first body that it meets, theory (4.22): the depth in the middle of its way through
/// it, times the transmittance in front, for what hides a body may hide its outline.
fn silhouette_violation(
    medium: &Medium<f32>,
    path: &Path<f32>,
    samples: RaySamples,
    weight: f32,
) -> Option<IndexSample> {
    let entry = path.steps.iter().position(|s| s.event.is_some_and(|e| !e.from_inside))?;
    let region = path.steps[entry].region;
    let (segment, step) = (path.segments.get(entry + 1)?, path.steps.get(entry + 1)?);
    let level = medium.regions()[region as usize].level_set()?;
    let x = segment.at(0.5 * step.drift);
    let is_inside = weight > 0.0 && level.domain().bounds.contains(x) && level.value(x) < 0.0;
    let before = samples.samples.iter().rev().find(|s| samples.segment_of(s).place as usize <= entry);
    let transmittance = before.map_or(1.0, |s| s.before * (1.0 - s.alpha));
    let d_value = -weight * transmittance / level.voxel();
    is_inside.then_some(IndexSample {
        region: region.into(),
        surface: true,
        x,
        d_value,
        d_gradient: Vec3::zero(),
    })
}
