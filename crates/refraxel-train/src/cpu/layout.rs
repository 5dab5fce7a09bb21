//! How the channels of a voxel lie in vectors, and the SH basis of a direction in the same order.
//!
//! A voxel's 3 × basis SH coefficients lie in `BLOCKS` vectors of 16 lanes; colour channel c owns the lanes
//! `c * basis .. (c + 1) * basis`.

use refraxel_core::Vec3;
use refraxel_core::sh::{self, MAX_BASIS, ShDegree};

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
    pub masks: [Lanes; 3],
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
        self.repeated(&self.basis_of(&sh::basis(self.degree, direction)[..self.degree.basis()]))
    }

    /// A basis with these functions.
    #[inline(always)]
    pub(super) fn basis_of(&self, functions: &[f32]) -> Basis {
        let mut basis = Basis([0.0; MAX_BASIS]);
        basis.0[..self.degree.basis()].copy_from_slice(functions);
        basis
    }

    /// The functions of a basis, repeated for each colour.
    #[inline(always)]
    pub(super) fn repeated(&self, basis: &Basis) -> Lanes {
        let mut repeated = [[0.0; LANES]; MAX_BLOCKS];
        let lanes = repeated.as_flattened_mut();
        for c in 0..3 {
            // The zeros behind the functions are written over by those of the next colour.
            lanes[c * self.degree.basis()..][..MAX_BASIS].copy_from_slice(&basis.0);
        }
        repeated
    }

    /// The basis of which these lanes are the repetition.
    #[inline(always)]
    pub(super) fn functions_of(&self, lanes: &Lanes) -> Basis {
        self.basis_of(&lanes.as_flattened()[..self.degree.basis()])
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
    pub layout: &'a Layout,
    /// As from [`Layout::basis`].
    pub basis: &'a Lanes,
}

/// The functions of a basis in one cache line, with zeros behind them.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Basis([f32; MAX_BASIS]);

impl Basis {
    /// All functions, and the zeros behind them.
    pub(super) fn functions(&self) -> &[f32; MAX_BASIS] {
        &self.0
    }
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
