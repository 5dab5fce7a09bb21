//! The second half of a step: each bucket of voxels adds up its records, feels its priors and moves.

use super::colour::scatter;
use super::layout::{LANES, Layout, voxels, voxels_mut};
use super::prefetch::prefetch;
use super::record::DENSITY_GRADIENT;
use super::tape::{BUCKET_VOXELS, Tape, fetch_ahead};
use crate::backend::{BUCKET_SLOTS, Objective, RULE};
use fearless_simd::{Simd, f32x16, prelude::*};
use fearless_simd_macros::simd;
use refraxel_core::grid::{BRICK_VOXELS, trilinear};
use refraxel_core::{AlignedVec, Vec3};
use std::sync::Mutex;

/// Voxels between prefetch and use.
const AHEAD: usize = 8;

/// Gradient of one bucket.
pub(super) struct BucketGradient {
    pub density: AlignedVec<f32>,
    pub colour: AlignedVec<f32>,
    /// Per slot, what of its voxels received a gradient. Bytes, not bits: neighbours in one word would wait for each other.
    pub touched: Vec<[Touched; BRICK_VOXELS]>,
}

/// What of a voxel received a gradient.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Touched {
    Nothing,
    /// Total variation of density alone: its colour waits in memory.
    Density,
    All,
}

impl BucketGradient {
    pub(super) fn new(stride: usize) -> Self {
        Self {
            density: AlignedVec::filled(BUCKET_VOXELS, 0.0),
            colour: AlignedVec::filled(BUCKET_VOXELS * stride, 0.0),
            touched: vec![[Touched::Nothing; BRICK_VOXELS]; BUCKET_SLOTS],
        }
    }

    /// The voxels of the bucket that received a gradient.
    pub(super) fn touched_voxels(&self) -> Vec<u16> {
        let mut voxels = Vec::with_capacity(BUCKET_VOXELS);
        for (voxel, touched) in (0..).zip(self.touched.as_flattened()) {
            if *touched != Touched::Nothing {
                voxels.push(voxel);
            }
        }
        voxels
    }

    /// Back to zero, touching only what was touched.
    fn clear(&mut self, stride: usize) {
        for (slot, touched) in self.touched.iter_mut().enumerate() {
            let voxels = slot * BRICK_VOXELS..(slot + 1) * BRICK_VOXELS;
            if touched.contains(&Touched::All) {
                self.colour[voxels.start * stride..voxels.end * stride].fill(0.0);
            } else if !touched.contains(&Touched::Density) {
                continue;
            }
            touched.fill(Touched::Nothing);
            self.density[voxels].fill(0.0);
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
    let BucketGradient { density, colour, touched } = grad;
    // Arrays of a known length take no checks of each index.
    let colour = voxels_mut::<BLOCKS>(colour).as_mut_array::<BUCKET_VOXELS>().expect("a bucket's voxels");
    let density = density.as_mut_array::<BUCKET_VOXELS>().expect("a bucket's voxels");
    let touched = touched.as_flattened_mut().as_mut_array::<BUCKET_VOXELS>().expect("a bucket's voxels");
    let first = (bucket * BUCKET_VOXELS) as u32;
    let (learning, last) = (first.max(BRICK_VOXELS as u32), first + BUCKET_VOXELS as u32);
    for (k, tape) in tapes.iter().enumerate() {
        fetch_ahead(tapes, k, bucket);
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
                density[voxel % BUCKET_VOXELS] += weight * r.d_theta;
                touched[voxel % BUCKET_VOXELS] = Touched::All;
            }
            if of_gradient {
                continue;
            }
            let basis = field.layout.repeated(&tape.bases[r.basis as usize]);
            let coloured = field.layout.with(&basis);
            if n == 8 {
                scatter(simd, colour, &own, coloured, r.d_colour);
            } else {
                scatter(simd, colour, &own[..n], coloured, r.d_colour);
            }
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

/// Words that tell of a voxel, beside those of its channels: its number, its density and the moments.
pub(super) const SYNC_WORDS: usize = 4;

impl BucketParameters<'_> {
    /// The voxels that a gradient has moved, and how they are now.
    pub(super) fn told(&self, bucket: usize, grad: &BucketGradient, channels: usize) -> Vec<u32> {
        let (first, stride) = ((bucket * BUCKET_VOXELS) as u32, self.colour.len() / self.density.len());
        let touched = grad.touched_voxels();
        let mut words = Vec::with_capacity(touched.len() * (SYNC_WORDS + channels));
        for voxel in touched {
            let k = usize::from(voxel);
            let numbers = [self.density[k], self.density_moment[k], self.colour_moment[k]];
            words.push(first + u32::from(voxel));
            words.extend(numbers.iter().chain(&self.colour[k * stride..][..channels]).map(|x| x.to_bits()));
        }
        words
    }
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
    let touched = grad.touched_voxels();
    for (k, &voxel) in touched.iter().enumerate() {
        if let Some(&next) = touched.get(k + AHEAD) {
            for b in 0..BLOCKS {
                prefetch(colours.as_flattened(), usize::from(next) * BLOCKS + b);
            }
        }
        let voxel = usize::from(voxel);
        let moment = &mut p.density_moment[voxel];
        p.density[voxel] += RULE.step(grad.density[voxel], moment, objective.rate_density);
        finite &= p.density[voxel].is_finite();
        if grad.touched.as_flattened()[voxel] == Touched::Density {
            RULE.scale(0.0, &mut p.colour_moment[voxel], objective.rate_colour);
            continue;
        }
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
    finite && simd.reduce_sum_f32x16(drift) == 0.0
}
