//! The radiance field: density and spherical-harmonic colour on a sparse voxel grid, theory (3.4)–(3.7).
//!
//! This is the readable reference, generic over the scalar; fast backends are tested against it. Both nonlinearities,
//! softplus of the density and the clamp of the colour, follow interpolation, so that a surface can lie anywhere between
//! two nodes.

use crate::grid::{BRICK_VOXELS, BrickMap, Domain, trilinear};
use crate::sh::{MAX_BASIS, ShDegree};
use crate::{AlignedVec, Real, Vec3};

/// Raw density θ of empty space [1], the value in absent bricks. softplus(−10) = 4.5e-5, so σ L = 0.0018: invisible over
/// any path through the box.
pub const EMPTY_DENSITY: f64 = -10.0;

/// Density per unit of softplus, times the longest edge L of the box [1]: σ = 40/L · softplus(θ), theory (3.5). The same
/// parameters then render the same picture at any scale of the world. At θ = 0 the box is 28 optical depths wide.
pub const DENSITY_PER_BOX: f64 = 40.0;

/// A sparse voxel radiance field.
#[derive(Clone, Debug)]
pub struct VoxelField<T: Copy> {
    /// Where the grid lies, and its nodes per axis.
    pub domain: Domain<T>,
    /// Which bricks are stored.
    pub map: BrickMap,
    /// Angular degree of colour.
    pub degree: ShDegree,
    /// Raw density θ [1], one per voxel of the map, in the order of its slots.
    pub density: AlignedVec<T>,
    /// SH coefficients [1], `degree.stride()` per voxel in the same order: `degree.basis()` of red, then of green, then of
    /// blue, then zeros as padding.
    pub colour: AlignedVec<T>,
}

/// dLoss/dparameters, laid out like the field.
#[derive(Clone, Debug)]
pub struct FieldGradient<T: Copy> {
    /// With respect to [`VoxelField::density`].
    pub density: AlignedVec<T>,
    /// With respect to [`VoxelField::colour`].
    pub colour: AlignedVec<T>,
}

/// Density and colour of the field at one point, theory (3.5) and (3.7).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matter<T> {
    /// Density σ ≥ 0 [1 / scene unit].
    pub density: T,
    /// Colour c ≥ 0 towards the viewer (sRGB-encoded, 1 = white).
    pub colour: [T; 3],
}

/// softplus(x) = ln(1 + eˣ), without overflow: the density of theory (3.5) before scaling. Its slope never vanishes, so a
/// voxel that has become empty can return.
#[inline(always)]
pub fn softplus<T: Real>(x: T) -> T {
    x.max(T::zero()) + (-x.abs()).exp().ln_1p()
}

/// Derivative of [`softplus`]: the logistic function 1/(1 + e⁻ˣ), without overflow.
#[inline(always)]
pub fn logistic<T: Real>(x: T) -> T {
    let e = (-x.abs()).exp();
    if x >= T::zero() { (T::one() + e).recip() } else { e / (T::one() + e) }
}

impl<T: Real> VoxelField<T> {
    /// A field with constant raw density θ and mid-grey colour, whose SH coefficients are all 0.
    pub fn uniform(domain: Domain<T>, map: BrickMap, degree: ShDegree, density: T) -> Self {
        let mut field = Self {
            domain,
            degree,
            density: AlignedVec::filled(map.voxels(), density),
            colour: AlignedVec::filled(map.voxels() * degree.stride(), T::zero()),
            map,
        };
        field.clear_empty_brick();
        field
    }

    /// Gives the voxels of the empty slot the values of empty space. Call it after writing to all voxels.
    pub fn clear_empty_brick(&mut self) {
        let n = BRICK_VOXELS;
        self.density[..n].fill(T::of(EMPTY_DENSITY));
        self.colour[..n * self.degree.stride()].fill(T::zero());
    }

    /// 40/L of theory (3.5) [1 / scene unit]: σ = `density_scale` · softplus(θ).
    pub fn density_scale(&self) -> T {
        T::of(DENSITY_PER_BOX) / self.domain.depth()
    }

    /// A gradient of zeros, laid out like the field.
    pub fn zero_gradient(&self) -> FieldGradient<T> {
        FieldGradient {
            density: AlignedVec::filled(self.density.len(), T::zero()),
            colour: AlignedVec::filled(self.colour.len(), T::zero()),
        }
    }

    /// Corners of the cell around node coordinates `g` and the position within the cell; `None` outside the grid.
    fn locate(&self, g: Vec3<T>) -> Option<([u32; 8], Vec3<T>)> {
        let n = self.map.resolution();
        if !(0..3).all(|a| g[a] >= T::zero() && g[a] <= T::of(f64::from(n[a] - 1))) {
            return None;
        }
        // The last node belongs to the last cell.
        let base: [u32; 3] = std::array::from_fn(|a| (g[a].f64() as u32).min(n[a] - 2));
        let f = g - Vec3::from(base.map(|b| T::of(f64::from(b))));
        // A cell whose own brick is absent is empty, also where its upper corners touch stored bricks.
        Some((self.map.corners(self.map.cell(base)?), f))
    }

    /// Density and colour at a world point, theory (3.4)–(3.7): softplus and the clamp at 0 follow interpolation.
    ///
    /// `x` [scene unit]; `y` = SH basis values of the unit direction of travel. `None` outside the grid and in cells
    /// whose own brick is not stored.
    pub fn at(&self, x: Vec3<T>, y: &[T; MAX_BASIS]) -> Option<Matter<T>> {
        let (corners, f) = self.locate(self.domain.node(x))?;
        let w = trilinear::weights(f);
        let theta: T = corners.iter().zip(w).map(|(&v, w)| w * self.density[v as usize]).sum();
        let colour = std::array::from_fn(|c| {
            let sum: T = corners.iter().zip(w).map(|(&v, w)| w * self.radiance_of(v, c, y)).sum();
            (sum + T::of(0.5)).max(T::zero())
        });
        Some(Matter { density: self.density_scale() * softplus(theta), colour })
    }

    /// h ∇θ [1 / voxel] at a world point, theory (7.13), h being the shortest edge of a voxel inside the box; 0 where nothing
    /// is stored. Not continuous across the faces of cells.
    pub fn raw_slope(&self, x: Vec3<T>) -> Vec3<T> {
        let Some((corners, f)) = self.locate(self.domain.node(x)) else { return Vec3::zero() };
        let theta_at = corners.map(|v| self.density[v as usize]);
        self.domain.node_vjp(x, trilinear::gradient(f, &theta_at)) * self.domain.voxel()
    }

    /// Transpose of [`Self::raw_slope`] by the raw density, theory (7.15): adds to `grad`, given dLoss/d(h ∇θ).
    pub fn raw_slope_vjp(&self, x: Vec3<T>, d_slope: Vec3<T>, grad: &mut FieldGradient<T>) {
        let Some((corners, f)) = self.locate(self.domain.node(x)) else { return };
        let d_node = self.domain.node_jvp(x, d_slope) * self.domain.voxel();
        for (v, d) in corners.iter().zip(trilinear::gradient_vjp(f, d_node)) {
            if *v as usize >= BRICK_VOXELS {
                grad.density[*v as usize] += d;
            }
        }
    }

    /// Σ_j Y_j k_j of one voxel and colour channel.
    fn radiance_of(&self, voxel: u32, channel: usize, y: &[T; MAX_BASIS]) -> T {
        let (nb, stride) = (self.degree.basis(), self.degree.stride());
        let k = &self.colour[voxel as usize * stride + channel * nb..][..nb];
        k.iter().zip(y).map(|(&k, &y)| k * y).sum()
    }

    /// Transpose of the derivative of [`Self::at`], theory (3.13) and the first line of (3.14): adds to `grad`, returns
    /// (dLoss/dx [1 / scene unit], dLoss/dy).
    ///
    /// Not differentiable on cell faces (x only) and where a colour is clamped at 0.
    pub fn at_vjp(
        &self,
        x: Vec3<T>,
        y: &[T; MAX_BASIS],
        d: &Matter<T>,
        grad: &mut FieldGradient<T>,
    ) -> (Vec3<T>, [T; MAX_BASIS]) {
        let mut d_y = [T::zero(); MAX_BASIS];
        let Some((corners, f)) = self.locate(self.domain.node(x)) else { return (Vec3::zero(), d_y) };
        let Some(value) = self.at(x, y) else { return (Vec3::zero(), d_y) };
        let w = trilinear::weights(f);
        let theta_at = corners.map(|v| self.density[v as usize]);
        let theta: T = theta_at.iter().zip(w).map(|(&t, w)| w * t).sum();
        let d_theta = d.density * self.density_scale() * logistic(theta);
        let mut d_node = trilinear::gradient(f, &theta_at) * d_theta;
        // Voxels of the empty brick are constants, not parameters.
        let stored = || corners.iter().zip(w).filter(|(v, _)| **v as usize >= BRICK_VOXELS);
        for (v, w) in stored() {
            grad.density[*v as usize] += w * d_theta;
        }
        let (nb, stride) = (self.degree.basis(), self.degree.stride());
        for c in (0..3).filter(|&c| value.colour[c] > T::zero()) {
            let at = corners.map(|v| self.radiance_of(v, c, y));
            d_node += trilinear::gradient(f, &at) * d.colour[c];
            for (v, w) in stored() {
                let first = *v as usize * stride + c * nb;
                for j in 0..nb {
                    grad.colour[first + j] += w * y[j] * d.colour[c];
                    d_y[j] += w * self.colour[first + j] * d.colour[c];
                }
            }
        }
        (self.domain.node_vjp(x, d_node), d_y)
    }
}
