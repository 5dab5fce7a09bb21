//! Where paths meet matter, segment by segment, and on the way back what their segments receive from their samples.

use super::colour::{SampleStencil, shade_sample_vjp};
use super::layout::{LANES, MAX_BLOCKS, voxels};
use super::packet::Packet;
use super::record::Record;
use super::sample::{MarchedSegment, RaySamples, Samples};
use super::scene::Scene;
use super::view::View;
use fearless_simd::Simd;
use fearless_simd_macros::simd;
use refraxel_core::Vec3;
use refraxel_core::grid::trilinear;
use refraxel_core::optimiser::near_share;
use refraxel_core::radiance::{Segment, SegmentAdjoint};

/// The second stage: the samples of all paths, without their colours. Without offsets, points lie in the middle of their steps.
#[inline(always)]
pub(super) fn march<S: Simd>(simd: S, view: &View, offsets: &[f32], packet: &mut Packet) {
    let Packet { seen, rays, paths, .. } = packet;
    seen.clear();
    for ((i, ray), path) in rays.iter_mut().enumerate().zip(paths) {
        let offset = offsets.get(i).copied().unwrap_or(0.5);
        let first = seen.samples.len();
        ray.left = march_path(simd, view, &path.segments, offset, seen);
        ray.samples = first..seen.samples.len();
    }
}

/// Appends the samples of one path, from the point `offset` steps along it on; the transmittance at its end.
#[simd]
pub(super) fn march_path<S: Simd>(
    simd: S,
    view: &View,
    path: &[Segment<f32>],
    offset: f32,
    out: &mut Samples,
) -> f32 {
    let (scene, marcher) = (view.scene, &view.scene.marcher);
    let mut front = marcher.start(offset, view, out.samples.len());
    let mut arc = 0.0;
    for (place, segment) in path.iter().enumerate() {
        let speed = segment.momentum.length();
        if segment.range[0] < segment.range[1] {
            let number = out.segments.len() as u32;
            if marcher.march(simd, segment, number, &mut front, &mut out.samples) {
                let unit = segment.momentum / speed;
                let (basis, place) = (scene.layout.basis(unit), place as u32);
                out.segments.push(MarchedSegment { segment: *segment, place, unit, speed, arc, basis });
            }
            if front.opaque {
                break;
            }
        }
        arc += speed * segment.range[1];
    }
    marcher.finish(simd, &mut front, &mut out.samples);
    front.transmittance
}

/// By `records` of samples, the field moves as much as their distance from the camera allows, theory (4.29): what else learns from them has
/// learned.
#[inline(always)]
pub(super) fn fade(records: &mut [Record], samples: RaySamples, eye: Vec3<f32>, full: f32) {
    if full <= 0.0 {
        return;
    }
    for (r, s) in records.iter_mut().zip(samples.samples) {
        let share = near_share((samples.segment_of(s).segment.at(s.t) - eye).length(), full);
        r.d_theta *= share;
        r.d_colour = r.d_colour.map(|d| share * d);
    }
}

/// The way back of the second and the third stage: dLoss/d(start, momentum) of a path's segments, from the `records` of its samples.
/// Segments before the first that counts are left out: no index moves them.
#[inline(always)]
pub(super) fn march_vjp<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    ray: RaySamples,
    mut records: &[Record],
    first: usize,
    d_segments: &mut [SegmentAdjoint<f32>],
) {
    let colour = voxels::<BLOCKS>(&scene.field.colour);
    for samples in ray.samples.chunk_by(|a, b| a.segment == b.segment) {
        let (own, others) = records.split_at(samples.len());
        records = others;
        let on = ray.segment_of(&samples[0]);
        if (on.place as usize) < first {
            continue;
        }
        let (coloured, sum) = (scene.layout.with(&on.basis), &mut d_segments[on.place as usize]);
        let mut d_basis = [[0.0; LANES]; MAX_BLOCKS];
        for (s, r) in samples.iter().zip(own) {
            let theta_at = s.corners.map(|v| scene.field.density[v as usize]);
            let stencil = SampleStencil { corners: &s.corners, weights: &s.weights, fraction: s.fraction };
            let d_node = shade_sample_vjp(simd, colour, stencil, coloured, r.d_colour, &mut d_basis);
            let d_node = d_node + trilinear::gradient(s.fraction, &theta_at) * r.d_theta;
            let d_x = scene.field.domain.node_vjp(on.segment.at(s.t), d_node);
            // dLoss/dτ · dτ/d|p| with τ = σ dt |p|.
            let d_tau = if s.slope > 0.0 { r.d_theta / s.slope } else { 0.0 };
            sum.start += d_x;
            sum.momentum += d_x * s.t + on.unit * (d_tau * s.tau / on.speed);
        }
        // All samples of a segment have one direction, and what it receives is linear in what they owe.
        let d_unit = scene.layout.basis_vjp(on.unit, &d_basis);
        sum.momentum += (d_unit - on.unit * on.unit.dot(d_unit)) / on.speed;
    }
}
