//! The second half of a step: each bucket of voxels adds up its records, feels its priors and moves.

use super::colour::{LANES, Layout, scatter, voxels, voxels_mut};
use super::record::DENSITY_GRADIENT;
use super::tape::{BUCKET_VOXELS, Tape};
use crate::backend::{BUCKET_SLOTS, Objective, RULE, TV_EPSILON};
use fearless_simd::{Simd, f32x16, prelude::*};
use fearless_simd_macros::simd;
use refraxel_core::grid::{BRICK_VOXELS, EMPTY_SLOT, trilinear};
use refraxel_core::priors::charbonnier_slope;
use refraxel_core::{AlignedVec, Vec3, VoxelField};
use std::sync::Mutex;

/// Gradient of one bucket.
pub(super) struct BucketGradient {
    pub density: AlignedVec<f32>,
    pub colour: AlignedVec<f32>,
    /// One bit per voxel that received a gradient, per slot.
    pub touched: Vec<u64>,
}

impl BucketGradient {
    pub(super) fn new(stride: usize) -> Self {
        Self {
            density: AlignedVec::filled(BUCKET_VOXELS, 0.0),
            colour: AlignedVec::filled(BUCKET_VOXELS * stride, 0.0),
            touched: vec![0; BUCKET_SLOTS],
        }
    }

    /// Back to zero, touching only what was touched.
    fn clear(&mut self, stride: usize) {
        for (slot, bits) in self.touched.iter_mut().enumerate().filter(|(_, b)| **b != 0) {
            *bits = 0;
            let voxels = slot * BRICK_VOXELS..(slot + 1) * BRICK_VOXELS;
            self.density[voxels.clone()].fill(0.0);
            self.colour[voxels.start * stride..voxels.end * stride].fill(0.0);
        }
    }
}

/// Cleared gradients for reuse: a bucket needs half a megabyte, too much to ask the system for at every turn.
pub(super) struct GradientPool {
    stride: usize,
    free: Mutex<Vec<BucketGradient>>,
}

impl GradientPool {
    pub(super) fn new(stride: usize) -> Self {
        Self { stride, free: Mutex::new(Vec::new()) }
    }

    /// A gradient of zeros.
    pub(super) fn take(&self) -> BucketGradient {
        let free = self.free.lock().ok().and_then(|mut f| f.pop());
        free.unwrap_or_else(|| BucketGradient::new(self.stride))
    }

    /// Clear a gradient and keep it.
    pub(super) fn give(&self, mut grad: BucketGradient) {
        grad.clear(self.stride);
        if let Ok(mut free) = self.free.lock() {
            free.push(grad);
        }
    }
}

/// Add the records of a bucket, in order.
#[simd]
pub(super) fn accumulate<S: Simd, const BLOCKS: usize>(
    simd: S,
    field: &VoxelFieldView,
    bucket: usize,
    tapes: &[Tape],
    grad: &mut BucketGradient,
) {
    let colour = voxels_mut::<BLOCKS>(&mut grad.colour);
    let first = (bucket * BUCKET_VOXELS) as u32;
    let (learning, last) = (first.max(BRICK_VOXELS as u32), first + BUCKET_VOXELS as u32);
    for tape in tapes {
        for r in tape.of_bucket(bucket) {
            let corners = field.map.corners(r.cell);
            let of_gradient = r.basis == DENSITY_GRADIENT;
            let weights = if of_gradient {
                trilinear::gradient_vjp(r.fraction, Vec3::from(r.d_colour))
            } else {
                trilinear::weights(r.fraction)
            };
            let (mut own, mut n) = ([(0, 0.0); 8], 0);
            for k in 0..8 {
                own[n] = (corners[k].wrapping_sub(first) as usize, weights[k]);
                // The empty brick (slot 0) lies in bucket 0 but never learns.
                n += usize::from(corners[k].wrapping_sub(learning) < last - learning);
            }
            for &(voxel, weight) in &own[..n] {
                grad.density[voxel] += weight * r.d_theta;
                grad.touched[voxel / BRICK_VOXELS] |= 1 << (voxel % BRICK_VOXELS);
            }
            if of_gradient {
                continue;
            }
            let coloured = field.layout.with(&tape.bases[r.basis as usize]);
            scatter(simd, colour, &own[..n], coloured, r.d_colour);
        }
    }
}

/// What the owner of a bucket may read of the whole field while others write.
pub(super) struct VoxelFieldView<'a> {
    pub map: &'a refraxel_core::BrickMap,
    pub layout: &'a Layout,
}

/// Parameters and moments of one bucket.
pub(super) struct BucketParameters<'a> {
    pub density: &'a mut [f32],
    pub density_moment: &'a mut [f32],
    pub colour: &'a mut [f32],
    pub colour_moment: &'a mut [f32],
}

/// RMSProp, theory (4.7), on the touched voxels, whose colours have `channels` parameters; false when a parameter became NaN
/// or infinite.
#[simd]
pub(super) fn descend<S: Simd, const BLOCKS: usize>(
    simd: S,
    p: &mut BucketParameters,
    grad: &BucketGradient,
    channels: usize,
    objective: &Objective,
) -> bool {
    let (gradients, colours) = (voxels::<BLOCKS>(&grad.colour), voxels_mut::<BLOCKS>(p.colour));
    let per_channel = 1.0 / channels as f32;
    let basis = channels / 3;
    let mut share = [[1.0; LANES]; BLOCKS];
    for lane in (0..channels).filter(|lane| lane % basis != 0) {
        share[lane / LANES][lane % LANES] = objective.rate_view;
    }
    // 0 x is 0 for every finite x and NaN for all others.
    let (mut finite, mut drift) = (true, f32x16::splat(simd, 0.0));
    for (slot, &bits) in grad.touched.iter().enumerate() {
        let mut bits = bits;
        while bits != 0 {
            let voxel = slot * BRICK_VOXELS + bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let moment = &mut p.density_moment[voxel];
            p.density[voxel] += RULE.step(grad.density[voxel], moment, objective.rate_density);
            finite &= p.density[voxel].is_finite();
            let g = &gradients[voxel];
            let mut square = f32x16::splat(simd, 0.0);
            for b in 0..BLOCKS {
                let g = f32x16::from_slice(simd, &g[b]);
                square = g.mul_add(g, square);
            }
            // One second moment serves all channels of a voxel's colour: the mean square of their gradients.
            let mean_square = simd.reduce_sum_f32x16(square) * per_channel;
            let factor = RULE.scale(mean_square, &mut p.colour_moment[voxel], objective.rate_colour);
            let colour = &mut colours[voxel];
            for b in 0..BLOCKS {
                let step = f32x16::from_slice(simd, &g[b]) * f32x16::from_slice(simd, &share[b]) * factor;
                let x = f32x16::from_slice(simd, &colour[b]) + step;
                x.store_slice(&mut colour[b]);
                drift += x * 0.0;
            }
        }
    }
    finite && simd.reduce_sum_f32x16(drift) == 0.0
}

/// Add the gradient of total variation over all voxels of a bucket, theory (4.3).
#[simd]
pub(super) fn total_variation<S: Simd, const BLOCKS: usize>(
    simd: S,
    field: &VoxelField<f32>,
    bucket: usize,
    objective: &Objective,
    grad: &mut BucketGradient,
) {
    let scale = objective.tv_period as f32;
    let slots = (bucket * BUCKET_SLOTS).max(1)..((bucket + 1) * BUCKET_SLOTS).min(field.map.slots());
    for slot in slots {
        let around = neighbour_slots(field, slot as u32);
        for local in 0..BRICK_VOXELS as u32 {
            let voxel = slot as u32 * BRICK_VOXELS as u32 + local;
            let here = voxel as usize - bucket * BUCKET_VOXELS;
            let mut any = false;
            for (axis, &[below, above]) in around.iter().enumerate() {
                for other in neighbours(slot as u32, local, axis, below, above).into_iter().flatten() {
                    any = true;
                    let d = field.density[voxel as usize] - field.density[other as usize];
                    grad.density[here] += scale * objective.tv_density * charbonnier_slope(d, TV_EPSILON);
                    if objective.tv_colour > 0.0 {
                        let weight = scale * objective.tv_colour;
                        let pair = [voxel, other];
                        let to = &mut grad.colour[here * BLOCKS * LANES..(here + 1) * BLOCKS * LANES];
                        colour_variation::<S, BLOCKS>(simd, &field.colour, pair, weight, to);
                    }
                }
            }
            if any {
                grad.touched[here / BRICK_VOXELS] |= 1 << local;
            }
        }
    }
}

/// Add weight · ψ'(v − other) for all lanes of a voxel to `grad`.
#[inline(always)]
fn colour_variation<S: Simd, const BLOCKS: usize>(
    simd: S,
    colour: &[f32],
    [voxel, other]: [u32; 2],
    weight: f32,
    grad: &mut [f32],
) {
    for b in 0..BLOCKS {
        let at = |v: u32| (v as usize * BLOCKS + b) * LANES;
        let x = f32x16::from_slice(simd, &colour[at(voxel)..at(voxel) + LANES]);
        let y = f32x16::from_slice(simd, &colour[at(other)..at(other) + LANES]);
        let d = x - y;
        let slope = d / (d * d + TV_EPSILON * TV_EPSILON).sqrt();
        let g = &mut grad[b * LANES..(b + 1) * LANES];
        slope.mul_add(f32x16::splat(simd, weight), f32x16::from_slice(simd, g)).store_slice(g);
    }
}

/// Slots below and above along each axis; [`EMPTY_SLOT`] where there is none.
fn neighbour_slots(field: &VoxelField<f32>, slot: u32) -> [[u32; 2]; 3] {
    let brick = field.map.brick_of(slot);
    std::array::from_fn(|axis| {
        [-1_i32, 1].map(|step| {
            let mut b = brick;
            b[axis] = b[axis].wrapping_add_signed(step);
            field.map.slot(b)
        })
    })
}

/// Stored voxels below and above a voxel along an axis. A neighbour in an absent brick does not count.
#[inline(always)]
fn neighbours(slot: u32, local: u32, axis: usize, below: u32, above: u32) -> [Option<u32>; 2] {
    let (stride, at) = (1 << (2 * axis), local >> (2 * axis) & 3);
    let voxel = |s: u32, l: u32| (s != EMPTY_SLOT).then_some(s * BRICK_VOXELS as u32 + l);
    [
        if at == 0 { voxel(below, local + 3 * stride) } else { voxel(slot, local - stride) },
        if at == 3 { voxel(above, local - 3 * stride) } else { voxel(slot, local + stride) },
    ]
}
