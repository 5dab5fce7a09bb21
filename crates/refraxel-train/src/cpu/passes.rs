//! The passes over a chunk of rays: render them, weigh their samples, or learn from them. All stages of a packet follow each
//! other while everything is in the cache.

use super::composite::{BatchLoss, composite};
use super::march::march_path;
use super::packet::{PACKET, Packet};
use super::record::Record;
use super::sample::Samples;
use super::scene::Scene;
use super::tape::Tape;
use super::trace::trace_ray;
use super::view::View;
use super::walk::{Adjoints, LearnedRay, Out, Scratch};
use crate::backend::{Marching, RayGradient, StepOutcome};
use fearless_simd::Simd;
use fearless_simd_macros::simd;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Path, Ray};
use std::ops::Range;

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
        scratch.forward::<S, BLOCKS>(simd, &view, rays, &[]);
        let Packet { seen, rays: marched, mirrored, .. } = &mut scratch.packet;
        for (ray, out) in marched.iter().zip(out) {
            let (own, mirrored) = (seen.of(ray.samples.clone()), &mut mirrored[ray.mirrored.clone()]);
            *out = composite(scene.background, ray, own, mirrored);
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
        trace_ray(&view, ray, &mut path);
        march_path(simd, &view, &path.segments, 0.5, &mut seen);
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
    let mut view = View::new(scene, &batch_loss.objective.marching);
    view.thin = batch_loss.objective.thin;
    let (mut scratch, mut adjoints) = (Scratch::default(), Adjoints::default());
    view.absorbing |= view.tracer.is_some() && batch_loss.objective.absorption.is_some();
    if view.absorbing {
        tape.absorption.resize(scene.refraction.medium.regions().len(), [0.0; 3]);
    }
    for start in range.clone().step_by(PACKET) {
        let numbers = start..(start + PACKET).min(range.end);
        let (rays, offsets) =
            (&batch_loss.batch.rays[numbers.clone()], &batch_loss.batch.offset[numbers.clone()]);
        scratch.forward::<S, BLOCKS>(simd, &view, rays, offsets);
        outcome.samples += scratch.packet.seen.samples.len() as u64;
        let Packet { seen, rays: found, paths, mirrored, absorbed, .. } = &mut scratch.packet;
        for ((number, found), path) in numbers.zip(found).zip(paths) {
            let filtered = absorbed.of(found.samples.clone());
            let mirrored = &mut mirrored[found.mirrored.clone()];
            let wanted = ray_gradients.get_mut(number - range.start);
            let out = Out { tape, adjoints: &mut adjoints, wanted };
            let ray = LearnedRay { number, found, path, mirrored, filtered };
            outcome.squared_error += ray.backward::<S, BLOCKS>(simd, &view, batch_loss, seen, out);
        }
    }
    tape.sort_touched(&scene.field.map);
    outcome
}
