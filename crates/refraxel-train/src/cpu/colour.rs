//! The colours of samples: SIMD kernels over the channels of a voxel, gather, its adjoints, scatter.
//!
//! Interpolation is linear per lane of a voxel (`layout`), so all work is over whole vectors and a colour is separated only
//! by a mask at the end. Loops are written out: a closure handed to a generic function (`map`, `from_fn`) is compiled
//! without the vector features of its caller.

use super::layout::{Coloured, Lanes, Layout, Voxel, voxels};
use super::prefetch::prefetch;
use super::sample::Samples;
use super::scene::Scene;
use super::tape::BUCKET_VOXELS;
use fearless_simd::{f32x16, prelude::*};
use fearless_simd_macros::simd;
use refraxel_core::Vec3;

/// Samples between prefetch and use.
const AHEAD: usize = 4;

/// The third stage: gives all samples their colours.
#[simd]
pub(super) fn shade<S: Simd, const BLOCKS: usize>(simd: S, scene: &Scene, seen: &mut Samples) {
    let (colour, Samples { samples, segments }) = (voxels::<BLOCKS>(&scene.field.colour), seen);
    for s in samples.iter().take(AHEAD) {
        prefetch_corners(colour, &s.corners);
    }
    for k in 0..samples.len() {
        if let Some(next) = samples.get(k + AHEAD) {
            prefetch_corners(colour, &next.corners);
        }
        let s = &mut samples[k];
        let coloured = scene.layout.with(&segments[s.segment as usize].basis);
        s.colour = shade_sample::<S, BLOCKS>(simd, colour, &s.corners, &s.weights, coloured);
    }
}

/// Where a sample lies: the voxels around it, their weights, and its position in the cell.
#[derive(Clone, Copy)]
pub(super) struct SampleStencil<'a> {
    pub corners: &'a [u32; 8],
    pub weights: &'a [f32; 8],
    pub fraction: Vec3<f32>,
}

/// Fetch the voxels around a sample into the cache.
#[inline(always)]
fn prefetch_corners<const BLOCKS: usize>(colour: &[Voxel<BLOCKS>], corners: &[u32; 8]) {
    let lines = colour.as_flattened();
    for &v in corners {
        for b in 0..BLOCKS {
            prefetch(lines, v as usize * BLOCKS + b);
        }
    }
}

/// Whether block `b` of a voxel of `blocks` blocks has lanes of colour `c`: those of 3 × 1 and 3 × 4 channels lie in one
/// block, those of 3 × 9 in two with green in both, and each of those of 3 × 16 in its own.
#[inline(always)]
const fn holds(blocks: usize, b: usize, c: usize) -> bool {
    match blocks {
        1 => true,
        2 => c == 1 || c == 2 * b,
        _ => c == b,
    }
}

/// The sums of three vectors.
#[inline(always)]
fn sums<S: Simd>(simd: S, of: &[f32x16<S>; 3]) -> [f32; 3] {
    // Lanes of the first and third vector alternate, then those of the second between them.
    let zero = f32x16::splat(simd, 0.0);
    let outer = simd.zip_low_f32x16(of[0], of[2]) + simd.zip_high_f32x16(of[0], of[2]);
    let inner = simd.zip_low_f32x16(of[1], zero) + simd.zip_high_f32x16(of[1], zero);
    let all = simd.zip_low_f32x16(outer, inner) + simd.zip_high_f32x16(outer, inner);
    let (low, high) = simd.split_f32x16(all);
    let (low, high) = simd.split_f32x8(low + high);
    let mut out = [0.0; 4];
    (low + high).store_slice(&mut out);
    [out[0], out[1], out[2]]
}

/// Interpolated coefficients Σ_k w_k v_k.
#[inline(always)]
fn gather<S: Simd, const BLOCKS: usize>(
    simd: S,
    colour: &[Voxel<BLOCKS>],
    corners: &[u32; 8],
    weights: &[f32; 8],
) -> [f32x16<S>; BLOCKS] {
    let mut sum = [f32x16::splat(simd, 0.0); BLOCKS];
    for k in 0..8 {
        let w = f32x16::splat(simd, weights[k]);
        let voxel = &colour[corners[k] as usize];
        for b in 0..BLOCKS {
            sum[b] = w.mul_add(f32x16::from_slice(simd, &voxel[b]), sum[b]);
        }
    }
    sum
}

/// Colour c = max(Σ_j Y_j k_j + ½, 0) at a sample, theory (3.7).
#[inline(always)]
fn shade_sample<S: Simd, const BLOCKS: usize>(
    simd: S,
    colour: &[Voxel<BLOCKS>],
    corners: &[u32; 8],
    weights: &[f32; 8],
    Coloured { layout, basis }: Coloured,
) -> [f32; 3] {
    let v = gather::<S, BLOCKS>(simd, colour, corners, weights);
    let mut of_colour = [f32x16::splat(simd, 0.0); 3];
    for b in 0..BLOCKS {
        let p = v[b] * f32x16::from_slice(simd, &basis[b]);
        for c in 0..3 {
            if holds(BLOCKS, b, c) {
                of_colour[c] = p.mul_add(f32x16::from_slice(simd, &layout.masks[c][b]), of_colour[c]);
            }
        }
    }
    let [r, g, b] = sums(simd, &of_colour);
    [(r + 0.5).max(0.0), (g + 0.5).max(0.0), (b + 0.5).max(0.0)]
}

/// The adjoint of each lane's colour.
#[inline(always)]
fn colour_of_lanes<S: Simd, const BLOCKS: usize>(
    simd: S,
    layout: &Layout,
    d_colour: [f32; 3],
) -> [f32x16<S>; BLOCKS] {
    let mut out = [f32x16::splat(simd, 0.0); BLOCKS];
    for b in 0..BLOCKS {
        for c in 0..3 {
            if holds(BLOCKS, b, c) {
                let mask = f32x16::from_slice(simd, &layout.masks[c][b]);
                out[b] = f32x16::splat(simd, d_colour[c]).mul_add(mask, out[b]);
            }
        }
    }
    out
}

/// dLoss/d(interpolated coefficients): basis × the adjoint of the lane's colour.
#[inline(always)]
fn coefficient_adjoint<S: Simd, const BLOCKS: usize>(
    simd: S,
    Coloured { layout, basis }: Coloured,
    d_colour: [f32; 3],
) -> [f32x16<S>; BLOCKS] {
    let mut out = colour_of_lanes::<S, BLOCKS>(simd, layout, d_colour);
    for b in 0..BLOCKS {
        out[b] *= f32x16::from_slice(simd, &basis[b]);
    }
    out
}

/// Add a sample's gradient to some of the voxels around it, given as (index in the bucket, weight).
#[inline(always)]
pub(super) fn scatter<S: Simd, const BLOCKS: usize>(
    simd: S,
    grad: &mut [Voxel<BLOCKS>; BUCKET_VOXELS],
    corners: &[(usize, f32)],
    coloured: Coloured,
    d_colour: [f32; 3],
) {
    let g = coefficient_adjoint::<S, BLOCKS>(simd, coloured, d_colour);
    for &(voxel, weight) in corners {
        let w = f32x16::splat(simd, weight);
        let voxel = &mut grad[voxel % BUCKET_VOXELS];
        for b in 0..BLOCKS {
            w.mul_add(g[b], f32x16::from_slice(simd, &voxel[b])).store_slice(&mut voxel[b]);
        }
    }
}

/// Adjoints that a ray's own gradient needs: d_colour · ∂c/∂node; the lane-wise adjoint of the basis is added to `d_basis`.
#[inline(always)]
pub(super) fn shade_sample_vjp<S: Simd, const BLOCKS: usize>(
    simd: S,
    colour: &[Voxel<BLOCKS>],
    SampleStencil { corners, weights, fraction }: SampleStencil,
    Coloured { layout, basis }: Coloured,
    d_colour: [f32; 3],
    d_basis: &mut Lanes,
) -> Vec3<f32> {
    let d_lanes = colour_of_lanes::<S, BLOCKS>(simd, layout, d_colour);
    let mut g = d_lanes;
    for b in 0..BLOCKS {
        g[b] *= f32x16::from_slice(simd, &basis[b]);
    }
    let mut v = [f32x16::splat(simd, 0.0); BLOCKS];
    // Lane by lane the derivative of the loss by the value at each corner; their sums over the lanes.
    let mut at = [f32x16::splat(simd, 0.0); 8];
    for k in 0..8 {
        let w = f32x16::splat(simd, weights[k]);
        for b in 0..BLOCKS {
            let lanes = f32x16::from_slice(simd, &colour[corners[k] as usize][b]);
            v[b] = w.mul_add(lanes, v[b]);
            at[k] = g[b].mul_add(lanes, at[k]);
        }
    }
    for b in 0..BLOCKS {
        let sum = &mut d_basis[b];
        d_lanes[b].mul_add(v[b], f32x16::from_slice(simd, sum)).store_slice(sum);
    }
    Vec3::from(sums(simd, &gradient(simd, fraction, &at)))
}

/// As [`trilinear::gradient`](refraxel_core::grid::trilinear::gradient), lane by lane.
#[inline(always)]
fn gradient<S: Simd>(simd: S, fraction: Vec3<f32>, v: &[f32x16<S>; 8]) -> [f32x16<S>; 3] {
    let mut out = [f32x16::splat(simd, 0.0); 3];
    for a in 0..3 {
        // Strides of the corners along the axis and along the other two.
        let [along, s, t] = [[1, 2, 4], [2, 1, 4], [4, 1, 2]][a];
        let [fs, ft] = [[fraction.y, fraction.z], [fraction.x, fraction.z], [fraction.x, fraction.y]][a];
        let (fs, ft) = (f32x16::splat(simd, fs), f32x16::splat(simd, ft));
        let near = v[along] - v[0];
        let near = (v[along + s] - v[s] - near).mul_add(fs, near);
        let far = v[along + t] - v[t];
        let far = (v[along + s + t] - v[s + t] - far).mul_add(fs, far);
        out[a] = (far - near).mul_add(ft, near);
    }
    out
}
