//! The passes over a chunk of rays: render them, weigh their samples, or learn from them. Tracing, marching, shading,
//! comparing and marching back follow each other while everything is in the cache.

use super::absorption::{FilteredRay, LengthAdjoint};
use super::compare::{BatchLoss, Compared, PixelAdjoint};
use super::layout::Layout;
use super::mirrored::{self, MirroredSample};
use super::packet::{MarchedRay, PACKET, Packet};
use super::path_adjoint::{BentPath, LearnsFrom, RayVjp, SegmentSums};
use super::record::{CLEARCOAT, IndexSample, Record};
use super::sample::{RaySamples, Samples};
use super::scene::Scene;
use super::secondary::{SecondaryRay, look_exactly};
use super::tape::Tape;
use super::view::View;
use crate::backend::{Batch, Marching, Objective, RayGradient, StepOutcome};
use crate::model::MirrorSource;
use fearless_simd::Simd;
use fearless_simd_macros::simd;
use refraxel_core::optics::PartialReflectionAdjoint;
use refraxel_core::radiance::{Filtered, Pixel};
use refraxel_core::{Medium, Path, Ray, Vec3};
use std::ops::Range;

/// Per-thread memory of a pass.
#[derive(Default)]
struct Scratch {
    packet: Packet,
    second: SecondaryRay,
    sums: Sums,
}

/// Memory of the way back.
#[derive(Default)]
struct Sums {
    sums: SegmentSums,
    d_reflections: Vec<PartialReflectionAdjoint<f32>>,
    density_gradients: Vec<Record>,
    lengths: LengthAdjoint,
}

impl Scratch {
    /// March and shade a packet, and let surfaces mirror what second rays see where these are the source.
    #[inline(always)]
    fn march_and_shade<S: Simd, const BLOCKS: usize>(
        &mut self,
        simd: S,
        view: &View,
        rays: &[Ray<f32>],
        offsets: &[f32],
    ) {
        view.march_packet::<S, BLOCKS>(simd, rays, offsets, &mut self.packet);
        if view.scene.reflection.source == MirrorSource::Exact {
            look_exactly::<S, BLOCKS>(simd, view, &mut self.second, &mut self.packet.mirrored);
        }
        if view.absorbing {
            self.packet.absorb(&view.scene.refraction.medium);
        }
    }
}

/// Render rays over the background.
#[simd]
pub(super) fn render_chunk<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    rays: &[Ray<f32>],
    marching: &Marching,
    out: &mut [Pixel<f32>],
) {
    let (view, mut scratch) = (View::new(scene, marching), Scratch::default());
    for (rays, out) in rays.chunks(PACKET).zip(out.chunks_mut(PACKET)) {
        scratch.march_and_shade::<S, BLOCKS>(simd, &view, rays, &[]);
        let Packet { seen, rays: marched, mirrored, .. } = &mut scratch.packet;
        let (mut first, mut first_mirrored) = (0, 0);
        for (ray, out) in marched.iter().zip(out) {
            let own = seen.of(first..ray.samples);
            *out = own.composite(ray.left);
            let behind = scene.background.radiance(ray.exit.origin, ray.exit.direction);
            let behind = ray.through.through(behind).colour;
            let mirrored = &mut mirrored[first_mirrored..ray.mirrored];
            out.colour = mirrored::shown(own.samples, mirrored, out, behind);
            (first, first_mirrored) = (ray.samples, ray.mirrored);
        }
    }
}

/// Record each sample's weight T a, for pruning, theory (4.11).
#[simd]
pub(super) fn weigh_chunk<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    rays: &[Ray<f32>],
    marching: &Marching,
) -> Tape {
    let (view, mut tape) = (View::new(scene, marching), Tape::default());
    let (mut seen, mut path) = (Samples::default(), Path::default());
    for ray in rays {
        seen.clear();
        view.march(simd, ray, 0.5, &mut path, &mut seen);
        tape.records.extend(seen.samples.iter().map(|s| Record {
            cell: s.cell,
            fraction: s.fraction,
            basis: 0,
            d_theta: s.before * s.alpha,
            d_colour: [0.0; 3],
        }));
    }
    tape.sort(&scene.field.map);
    tape
}

/// Forward and adjoint of a range of a batch: the records that the update needs, and each ray's own gradient if
/// `ray_gradients` has room for it.
#[simd]
pub(super) fn learn_chunk<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    batch_loss: BatchLoss,
    range: Range<usize>,
    tape: &mut Tape,
    ray_gradients: &mut [RayGradient],
) -> StepOutcome {
    tape.clear();
    let mut outcome = StepOutcome { finite: true, ..Default::default() };
    let (mut view, mut scratch) = (View::new(scene, &batch_loss.objective.marching), Scratch::default());
    view.absorbing |= view.tracer.is_some() && batch_loss.objective.absorption.is_some();
    if view.absorbing {
        tape.absorption.resize(scene.refraction.medium.regions().len(), [0.0; 3]);
    }
    for start in range.clone().step_by(PACKET) {
        let numbers = start..(start + PACKET).min(range.end);
        let (rays, offsets) =
            (&batch_loss.batch.rays[numbers.clone()], &batch_loss.batch.offset[numbers.clone()]);
        scratch.march_and_shade::<S, BLOCKS>(simd, &view, rays, offsets);
        outcome.samples += scratch.packet.seen.samples.len() as u64;
        let Scratch { packet, sums, .. } = &mut scratch;
        let Packet { seen, rays: marched, paths, mirrored, absorbed, .. } = packet;
        let (mut first, mut first_mirrored) = (0, 0);
        for ((ray, marched), path) in numbers.zip(marched).zip(paths) {
            let learned = LearnedRay {
                ray,
                marched,
                own: first..marched.samples,
                path,
                mirrored: &mut mirrored[first_mirrored..marched.mirrored],
                filtered: absorbed.of(first..marched.samples),
            };
            (first, first_mirrored) = (marched.samples, marched.mirrored);
            let wanted = ray_gradients.get_mut(ray - range.start);
            outcome.squared_error +=
                learned.ray_vjp::<S, BLOCKS>(simd, &view, batch_loss, seen, Out { tape, sums, wanted });
        }
    }
    tape.sort_touched(&scene.field.map);
    outcome
}

/// One ray of a packet.
struct LearnedRay<'a> {
    /// Its number in the batch.
    ray: usize,
    marched: &'a MarchedRay,
    /// Its samples in the packet's.
    own: Range<usize>,
    path: &'a Path<f32>,
    mirrored: &'a mut [MirroredSample],
    /// The colours of its samples behind what absorbs, where something does.
    filtered: &'a [Filtered<f32>],
}

/// Where the way back of a ray writes to.
struct Out<'a> {
    tape: &'a mut Tape,
    sums: &'a mut Sums,
    /// The gradient of the ray itself, where it is asked for.
    wanted: Option<&'a mut RayGradient>,
}

impl LearnedRay<'_> {
    /// Its weight in the loss. One that bends beside a mask counts whole: the body is wrong there, not what stands around it.
    #[inline(always)]
    fn weight(&self, batch: &Batch, objective: &Objective) -> f32 {
        let bends = self.marched.bent && self.path.bends(&batch.rays[self.ray]);
        if bends && !batch.is_beside(self.ray) { objective.bent_weight } else { 1.0 }
    }

    /// Compare the ray with its target and march back; its squared error.
    #[inline(always)]
    fn ray_vjp<S: Simd, const BLOCKS: usize>(
        self,
        simd: S,
        view: &View,
        batch_loss: BatchLoss,
        seen: &mut Samples,
        out: Out,
    ) -> f64 {
        let weight = self.weight(batch_loss.batch, batch_loss.objective);
        let Self { ray, marched, own, path, mirrored, filtered } = self;
        let Out { tape, sums, wanted } = out;
        let (scene, batch, objective) = (view.scene, batch_loss.batch, batch_loss.objective);
        let (left, exit, through) = (marched.left, &marched.exit, &marched.through);
        let compared = Compared { batch, ray, samples: seen.of(own.clone()), left, exit, through, weight };
        let d = compared.with_target(scene, batch_loss, mirrored, tape);
        let first = tape.records.len();
        sums.density_gradients.clear();
        let coated = mirrored.first().filter(|m| m.of.region == CLEARCOAT);
        if let Some((surface, mirrored)) = view.opaque_surface().zip(coated) {
            let Samples { samples, segments } = seen;
            let (direction, samples) = (batch.rays[ray].direction, &mut samples[own.clone()]);
            surface.look_back(direction, mirrored, samples, segments, &mut sums.density_gradients);
        }
        let samples = seen.of(own);
        march_sections(scene.layout, samples, mirrored, &d, tape);
        tape.records[first..].reverse();
        let absorbs = view.absorbing && marched.bent;
        if absorbs {
            let (medium, d_whole) = (&scene.refraction.medium, d.d_thickness);
            let filtered = FilteredRay { medium, path, samples, filtered, mirrored, d_whole };
            let (records, coefficients) = (&mut tape.records[first..], &mut tape.absorption);
            tape.overflows += filtered.ray_vjp(records, coefficients, &mut sums.lengths);
        }
        tape.touch(first, samples.samples);
        let others = tape.records.len();
        tape.records.append(&mut sums.density_gradients);
        tape.touch_from(others, &scene.field.map);
        let bent = view.tracer.as_ref().filter(|_| marched.bent);
        let learns_from =
            bent.map_or(LearnsFrom::NOTHING, |_| LearnsFrom::of(path, objective.index.as_ref()));
        let (squared_error, residual) = (d.squared_error, d.shown.d_colour.map(|d| 0.5 * d / weight));
        if wanted.is_none() && (learns_from == LearnsFrom::NOTHING || objective.index.is_none()) {
            return squared_error;
        }
        let d_exit = Compared { batch, ray, samples, left, exit, through, weight }.background_vjp(scene, &d);
        if bent.is_some() {
            mirrored::reflection_adjoints(scene.reflection, mirrored, &mut sums.d_reflections);
        }
        let d_reflections = &sums.d_reflections;
        let d_lengths = if absorbs { &sums.lengths.segments[..] } else { &[] };
        let bent = bent.map(|tracer| BentPath { tracer, path, learns_from, d_reflections, d_lengths });
        if learns_from.surface && batch.is_beside(ray) {
            let weight = objective.index.map_or(0.0, |o| o.silhouette);
            tape.index_samples.extend(silhouette_violation(&scene.refraction.medium, path, samples, weight));
        }
        let (ray, records, all) = (&batch.rays[ray], &tape.records[first..], wanted.is_some());
        let adjoint = RayVjp { ray, samples, records, d_exit, bent, all };
        let d_ray = adjoint.run::<S, BLOCKS>(simd, scene, &mut sums.sums, &mut tape.index_samples);
        if let Some(wanted) = wanted {
            *wanted = RayGradient { residual, ..d_ray };
        }
        squared_error
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

/// The sweep from the back over all sections of a ray.
#[inline(always)]
fn march_sections(
    layout: &Layout,
    samples: RaySamples,
    mirrored: &[MirroredSample],
    d: &PixelAdjoint,
    tape: &mut Tape,
) {
    let RaySamples { samples: all, segments } = samples;
    for section in mirrored::sections(all.len(), mirrored, d.shown) {
        let own = RaySamples { samples: &all[section.samples.clone()], segments };
        d.march_back(layout, own, &section, tape);
    }
}
