//! The fused pass over a chunk of rays: march, shade, compare, and march back while everything is in the cache.

use super::Scene;
use super::colour::{prefetch_corners, shade, shade_vjp, voxels};
use super::march::Sample;
use super::tape::{Record, Tape};
use crate::backend::{Batch, Marching, Objective, StepOutcome};
use fearless_simd::Simd;
use fearless_simd_macros::simd;
use refraxel_core::grid::trilinear;
use refraxel_core::priors::{cauchy_slope, opacity_beta_slope};
use refraxel_core::radiance::Pixel;
use refraxel_core::{Background, Ray, Vec3};
use std::ops::Range;

/// Rays marched before their samples are shaded: enough samples to prefetch across rays, few enough for the L2 cache.
const PACKET: usize = 8;
/// Samples between prefetch and use.
const AHEAD: usize = 4;

/// March and shade a packet of rays; `ends[i]` = (end of ray i in `samples`, final transmittance).
#[inline(always)]
fn march_packet<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    (rays, offsets): (&[Ray<f32>], &[f32]),
    marching: &Marching,
    scratch: &mut Scratch,
) {
    scratch.samples.clear();
    scratch.ends.clear();
    for (i, ray) in rays.iter().enumerate() {
        let offset = offsets.get(i).copied().unwrap_or(0.5);
        let left = scene.marcher.march(simd, scene.field, (ray, offset), marching, &mut scratch.samples);
        scratch.ends.push((scratch.samples.len(), left));
    }
    let colour = voxels::<BLOCKS>(&scene.field.colour);
    for s in scratch.samples.iter().take(AHEAD) {
        prefetch_corners(colour, &s.corners);
    }
    let mut first = 0;
    for (i, ray) in rays.iter().enumerate() {
        let end = scratch.ends[i].0;
        if first == end {
            continue;
        }
        let basis = scene.layout.basis(ray.direction);
        for k in first..end {
            if let Some(next) = scratch.samples.get(k + AHEAD) {
                prefetch_corners(colour, &next.corners);
            }
            let s = &mut scratch.samples[k];
            s.colour = shade::<S, BLOCKS>(simd, colour, &s.corners, &s.weights, (scene.layout, &basis));
        }
        first = end;
    }
}

/// Per-thread memory of the pass.
#[derive(Default)]
pub(super) struct Scratch {
    samples: Vec<Sample>,
    ends: Vec<(usize, f32)>,
}

/// C = Σ T a c over the samples of one ray, theory (3.9).
#[inline(always)]
fn composite(samples: &[Sample], transmittance: f32) -> Pixel<f32> {
    let mut pixel = Pixel { colour: [0.0; 3], transmittance, depth: 0.0 };
    for s in samples {
        let weight = s.before * s.alpha;
        for c in 0..3 {
            pixel.colour[c] += weight * s.colour[c];
        }
        pixel.depth += weight * s.t;
    }
    pixel
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
    let mut scratch = Scratch::default();
    for (rays, out) in rays.chunks(PACKET).zip(out.chunks_mut(PACKET)) {
        march_packet::<S, BLOCKS>(simd, scene, (rays, &[]), marching, &mut scratch);
        let mut first = 0;
        for (i, ray) in rays.iter().enumerate() {
            let (end, left) = scratch.ends[i];
            out[i] = composite(&scratch.samples[first..end], left);
            let behind = scene.background.radiance(ray.origin, ray.direction);
            for c in 0..3 {
                out[i].colour[c] += left * behind[c];
            }
            first = end;
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
    let (mut tape, mut samples) = (Tape::default(), Vec::new());
    for ray in rays {
        samples.clear();
        scene.marcher.march(simd, scene.field, (ray, 0.5), marching, &mut samples);
        tape.records.extend(samples.iter().map(|s| Record {
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
    batch: &Batch,
    range: Range<usize>,
    objective: &Objective,
    (tape, ray_gradients): (&mut Tape, &mut [(Vec3<f32>, Vec3<f32>)]),
) -> StepOutcome {
    tape.clear();
    let mut outcome = StepOutcome { finite: true, ..Default::default() };
    let mut scratch = Scratch::default();
    for start in range.clone().step_by(PACKET) {
        let packet = start..(start + PACKET).min(range.end);
        let rays = (&batch.rays[packet.clone()], &batch.offset[packet.clone()]);
        march_packet::<S, BLOCKS>(simd, scene, rays, &objective.marching, &mut scratch);
        outcome.samples += scratch.samples.len() as u64;
        let mut first = 0;
        for (i, ray) in packet.clone().enumerate() {
            let (end, left) = scratch.ends[i];
            let samples = &scratch.samples[first..end];
            let pixel = composite(samples, left);
            let d = compare(scene, (batch, ray), pixel, objective, tape);
            outcome.squared_error += d.squared_error;
            let records = tape.records.len();
            march_back(samples, &d, objective.sparsity, tape);
            if let Some(g) = ray_gradients.get_mut(ray - range.start) {
                let basis = *tape.bases.last().expect("march_back pushed the ray's basis");
                let made = (samples, &tape.records[records..]);
                *g = ray_gradient::<S, BLOCKS>(simd, scene, &batch.rays[ray], made, &basis);
                g.1 += background_vjp(scene, batch, ray, &d);
            }
            first = end;
        }
    }
    tape.sort(&scene.field.map);
    outcome
}

/// Where the adjoint of a ray starts.
struct RayAdjoint {
    squared_error: f64,
    colour: [f32; 3],
    transmittance: f32,
    behind: [f32; 3],
    last: f32,
    basis: super::colour::Lanes,
}

/// Compare a ray with its target: loss, its adjoint, the gradient of the background.
#[inline(always)]
fn compare(
    scene: &Scene,
    (batch, ray): (&Batch, usize),
    pixel: Pixel<f32>,
    objective: &Objective,
    tape: &mut Tape,
) -> RayAdjoint {
    let (r, target, left) = (&batch.rays[ray], batch.target[ray], pixel.transmittance);
    let given = batch.behind.get(ray);
    let behind = given.copied().unwrap_or_else(|| scene.background.radiance(r.origin, r.direction));
    let (mut colour, mut squared_error) = ([0.0; 3], 0.0);
    for c in 0..3 {
        let error = pixel.colour[c] + left * behind[c] - target[c];
        squared_error += f64::from(error * error);
        colour[c] = 2.0 * error;
    }
    if let (None, Background::Environment(map)) = (given, scene.background) {
        let stencil = map.stencil(r.direction);
        for k in 0..4 {
            let w = left * stencil.weight[k];
            tape.texels.push((stencil.index[k] as u32, colour.map(|g| w * g)));
        }
    }
    let transmittance =
        if objective.opacity > 0.0 { objective.opacity * opacity_beta_slope(left) } else { 0.0 };
    let basis = scene.layout.basis(r.direction);
    RayAdjoint { squared_error, colour, transmittance, behind, last: left, basis }
}

/// The sweep from the back: one record per sample, theory (3.10)–(3.13). The twin of [`composite`].
#[inline(always)]
fn march_back(samples: &[Sample], d: &RayAdjoint, sparsity: f32, tape: &mut Tape) {
    let basis = tape.bases.len() as u32;
    tape.bases.push(d.basis);
    let mut behind = d.behind;
    let start = tape.records.len();
    for s in samples.iter().rev() {
        let mut contrast = 0.0;
        let mut d_colour = [0.0; 3];
        for c in 0..3 {
            contrast += d.colour[c] * (s.colour[c] - behind[c]);
            // A colour clamped at 0 has no slope.
            d_colour[c] = if s.colour[c] > 0.0 { s.before * s.alpha * d.colour[c] } else { 0.0 };
            behind[c] += s.alpha * (s.colour[c] - behind[c]);
        }
        let mut d_tau = s.before * (1.0 - s.alpha) * contrast - d.last * d.transmittance;
        if sparsity > 0.0 {
            d_tau += sparsity * cauchy_slope(s.tau);
        }
        tape.records.push(Record {
            cell: s.cell,
            fraction: s.fraction,
            basis,
            d_theta: d_tau * s.slope,
            d_colour,
        });
    }
    tape.records[start..].reverse();
}

/// dLoss/d(origin, direction) of one ray from its samples and their records, theory (3.14).
#[inline(always)]
fn ray_gradient<S: Simd, const BLOCKS: usize>(
    simd: S,
    scene: &Scene,
    ray: &Ray<f32>,
    (samples, records): (&[Sample], &[Record]),
    basis: &super::colour::Lanes,
) -> (Vec3<f32>, Vec3<f32>) {
    let (mut d_origin, mut d_direction) = (Vec3::zero(), Vec3::zero());
    let (unit, colour) = (ray.direction, voxels::<BLOCKS>(&scene.field.colour));
    for (s, r) in samples.iter().zip(records) {
        let theta_at = s.corners.map(|v| scene.field.density[v as usize]);
        let sample = (&s.corners, &s.weights, s.fraction);
        let (d_node, d_basis) = shade_vjp(simd, colour, sample, (scene.layout, basis), r.d_colour);
        let d_node = d_node + trilinear::gradient(s.fraction, &theta_at) * r.d_theta;
        let d_x = scene.field.domain.node_vjp(ray.at(s.t), d_node);
        let d_unit = scene.layout.basis_vjp(unit, &d_basis);
        // dLoss/dτ · dτ/d|p| with τ = σ dt |p|.
        let d_tau = if s.slope > 0.0 { r.d_theta / s.slope } else { 0.0 };
        let stretch = d_tau * s.tau;
        d_origin += d_x;
        d_direction += d_x * s.t + unit * stretch + (d_unit - unit * unit.dot(d_unit));
    }
    (d_origin, d_direction)
}

/// dLoss/d(direction) through the background.
fn background_vjp(scene: &Scene, batch: &Batch, ray: usize, d: &RayAdjoint) -> Vec3<f32> {
    let Background::Environment(map) = scene.background else { return Vec3::zero() };
    if !batch.behind.is_empty() {
        return Vec3::zero();
    }
    let unit = batch.rays[ray].direction;
    let free = map.radiance_vjp(unit, d.colour.map(|g| g * d.last));
    free - unit * unit.dot(free)
}
