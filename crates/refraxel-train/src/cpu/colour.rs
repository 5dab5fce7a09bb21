//! SIMD kernels over the channels of a voxel: gather, its adjoints, scatter.
//!
//! A voxel's 3 × basis SH coefficients lie in `BLOCKS` vectors of 16 lanes; colour channel c owns the lanes
//! `c * basis .. (c + 1) * basis`. Interpolation is linear per lane, so all work is over whole vectors and a colour
//! is separated only by a mask at the end. Loops are written out: a closure handed to a generic function (`map`,
//! `from_fn`) is compiled without the vector features of its caller.

use super::prefetch::prefetch;
use fearless_simd::{f32x16, prelude::*};
use refraxel_core::sh::{self, MAX_BASIS, ShDegree};
use refraxel_core::{Vec3, grid::trilinear};

/// Lanes of a vector.
pub(super) const LANES: usize = 16;
/// Vectors of the widest voxel (degree 3: 48 lanes).
pub(super) const MAX_BLOCKS: usize = 3;

/// Values of all lanes of a voxel.
pub(super) type Lanes = [[f32; LANES]; MAX_BLOCKS];

/// Which lanes belong to which colour, as 0/1 factors.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    degree: ShDegree,
    masks: [Lanes; 3],
}

impl Layout {
    pub(super) fn new(degree: ShDegree) -> Self {
        let nb = degree.basis();
        let masks = std::array::from_fn(|c| {
            std::array::from_fn(|b| std::array::from_fn(|l| f32::from(u8::from((b * LANES + l) / nb == c))))
        });
        Self { degree, masks }
    }

    /// SH basis of a direction, repeated for each colour, zero in the padding.
    pub(super) fn basis(&self, direction: Vec3<f32>) -> Lanes {
        self.repeated(&sh::basis(self.degree, direction)[..self.degree.basis()])
    }

    /// The functions of a basis, repeated for each colour.
    pub(super) fn repeated(&self, basis: &[f32]) -> Lanes {
        let mut lanes = [[0.0; LANES]; MAX_BLOCKS];
        for own in lanes.as_flattened_mut().chunks_exact_mut(basis.len()).take(3) {
            own.copy_from_slice(basis);
        }
        lanes
    }

    /// Functions of a basis.
    pub(super) fn functions(&self) -> usize {
        self.degree.basis()
    }

    /// The layout together with the basis of one direction.
    #[inline(always)]
    pub(super) fn with<'a>(&'a self, basis: &'a Lanes) -> Coloured<'a> {
        Coloured { layout: self, basis }
    }

    /// Lane values summed over the colours, per basis function.
    fn fold(&self, lanes: &Lanes) -> [f32; MAX_BASIS] {
        let nb = self.degree.basis();
        let mut y = [0.0; MAX_BASIS];
        for own in lanes.as_flattened().chunks_exact(nb).take(3) {
            y.iter_mut().zip(own).for_each(|(y, lane)| *y += lane);
        }
        y
    }

    /// Σ_j ∇Y_j d_y[j] for the lane-wise adjoint of the basis.
    pub(super) fn basis_vjp(&self, direction: Vec3<f32>, d_lanes: &Lanes) -> Vec3<f32> {
        sh::basis_vjp(self.degree, direction, &self.fold(d_lanes))
    }
}

/// How a direction weighs the channels of a voxel.
#[derive(Clone, Copy)]
pub(super) struct Coloured<'a> {
    layout: &'a Layout,
    /// As from [`Layout::basis`].
    basis: &'a Lanes,
}

/// Where a sample lies: the voxels around it, their weights, and its position in the cell.
#[derive(Clone, Copy)]
pub(super) struct SampleStencil<'a> {
    pub corners: &'a [u32; 8],
    pub weights: &'a [f32; 8],
    pub fraction: Vec3<f32>,
}

/// The channels of one voxel.
pub(super) type Voxel<const BLOCKS: usize> = [[f32; LANES]; BLOCKS];

/// An array of channels, seen as voxels.
#[inline(always)]
pub(super) fn voxels<const BLOCKS: usize>(channels: &[f32]) -> &[Voxel<BLOCKS>] {
    channels.as_chunks().0.as_chunks().0
}

/// An array of channels, seen as voxels to write to.
#[inline(always)]
pub(super) fn voxels_mut<const BLOCKS: usize>(channels: &mut [f32]) -> &mut [Voxel<BLOCKS>] {
    channels.as_chunks_mut().0.as_chunks_mut().0
}

/// Fetch the voxels around a sample into the cache.
#[inline(always)]
pub(super) fn prefetch_corners<const BLOCKS: usize>(colour: &[Voxel<BLOCKS>], corners: &[u32; 8]) {
    let lines = colour.as_flattened();
    for &v in corners {
        for b in 0..BLOCKS {
            prefetch(lines, v as usize * BLOCKS + b);
        }
    }
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
pub(super) fn shade<S: Simd, const BLOCKS: usize>(
    simd: S,
    colour: &[Voxel<BLOCKS>],
    corners: &[u32; 8],
    weights: &[f32; 8],
    Coloured { layout, basis }: Coloured,
) -> [f32; 3] {
    let v = gather::<S, BLOCKS>(simd, colour, corners, weights);
    let mut sum = [f32x16::splat(simd, 0.0); 3];
    for b in 0..BLOCKS {
        let p = v[b] * f32x16::from_slice(simd, &basis[b]);
        for c in 0..3 {
            sum[c] = p.mul_add(f32x16::from_slice(simd, &layout.masks[c][b]), sum[c]);
        }
    }
    let mut out = [0.0; 3];
    for c in 0..3 {
        out[c] = (simd.reduce_sum_f32x16(sum[c]) + 0.5).max(0.0);
    }
    out
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
            let mask = f32x16::from_slice(simd, &layout.masks[c][b]);
            out[b] = f32x16::splat(simd, d_colour[c]).mul_add(mask, out[b]);
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

/// Add a sample's gradient to some of the voxels around it, given as (index relative to `grad`'s first voxel, weight).
#[inline(always)]
pub(super) fn scatter<S: Simd, const BLOCKS: usize>(
    simd: S,
    grad: &mut [Voxel<BLOCKS>],
    corners: &[(usize, f32)],
    coloured: Coloured,
    d_colour: [f32; 3],
) {
    let g = coefficient_adjoint::<S, BLOCKS>(simd, coloured, d_colour);
    for &(voxel, weight) in corners {
        let w = f32x16::splat(simd, weight);
        let voxel = &mut grad[voxel];
        for b in 0..BLOCKS {
            w.mul_add(g[b], f32x16::from_slice(simd, &voxel[b])).store_slice(&mut voxel[b]);
        }
    }
}

/// Adjoints that a ray's own gradient needs: d_colour · ∂c/∂node; the lane-wise adjoint of the basis is added to `d_basis`.
#[inline(always)]
pub(super) fn shade_vjp<S: Simd, const BLOCKS: usize>(
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
    let (mut at_corner, mut v) = ([0.0; 8], [f32x16::splat(simd, 0.0); BLOCKS]);
    for k in 0..8 {
        let w = f32x16::splat(simd, weights[k]);
        let mut dot = f32x16::splat(simd, 0.0);
        for b in 0..BLOCKS {
            let lanes = f32x16::from_slice(simd, &colour[corners[k] as usize][b]);
            v[b] = w.mul_add(lanes, v[b]);
            dot = g[b].mul_add(lanes, dot);
        }
        at_corner[k] = simd.reduce_sum_f32x16(dot);
    }
    for b in 0..BLOCKS {
        let sum = &mut d_basis[b];
        d_lanes[b].mul_add(v[b], f32x16::from_slice(simd, sum)).store_slice(sum);
    }
    trilinear::gradient(fraction, &at_corner)
}
