//! What a clearcoat is, and its strength from place to place.

use crate::radiance::probes::ProbeGrid;
use crate::{Real, Vec3, sh};

/// The clearcoat of all opaque objects of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Clearcoat<T> {
    /// Index of refraction of the clearcoat [1], > 1.
    pub ior: T,
    /// The strength ρ, the part of Fresnel's reflectance that a place really shows: red of probes of degree 0, between 0
    /// and 1. Green and blue are not used.
    pub strength: ProbeGrid<T>,
    /// The light that arrives at a place from a direction.
    pub radiance: ProbeGrid<T>,
}

/// The strength does not depend on a direction; this one is used for all cache look-ups.
const UP: Vec3<f64> = Vec3 { x: 0.0, y: 0.0, z: 1.0 };

impl<T: Real> Clearcoat<T> {
    /// The strength ρ at a place, in [0, 1].
    #[inline]
    pub fn strength_at(&self, x: Vec3<T>) -> T {
        let s = self.strength.stencil(x, UP.map(T::of));
        self.strength.radiance(&s)[0].min(T::one())
    }

    /// Keeps the strength of every probe at least `margin` away from 0 and 1, where it has no slope.
    pub fn bound_strength(&mut self, margin: T) {
        let y = sh::basis(self.strength.degree(), UP.map(T::of))[0];
        let most = (T::of(0.5) - margin) / y;
        let stride = self.strength.stride();
        for probe in self.strength.coefficients.chunks_exact_mut(stride) {
            probe[0] = probe[0].max(-most).min(most);
        }
    }

    /// dLoss/d(colour of the strength's probes at `x`) given dLoss/dρ: red only, and nothing where ρ is clamped at 1.
    #[inline]
    pub fn d_strength(&self, x: Vec3<T>, d_rho: T) -> [T; 3] {
        let s = self.strength.stencil(x, UP.map(T::of));
        let below = self.strength.radiance(&s)[0] < T::one();
        [if below { d_rho } else { T::zero() }, T::zero(), T::zero()]
    }

    /// Transpose of the derivative of [`Self::strength_at`] by `x`: dLoss/dx [1 / scene unit] given dLoss/dρ. Not
    /// differentiable between the cells of the probes.
    #[inline]
    pub fn strength_vjp(&self, x: Vec3<T>, d_rho: T) -> Vec3<T> {
        let up = UP.map(T::of);
        self.strength.radiance_vjp(&self.strength.stencil(x, up), up, self.d_strength(x, d_rho)).0
    }

    /// Transpose of the derivative of [`Self::strength_at`] by the coefficients of the strength: adds to `grad`.
    pub fn scatter_strength(&self, x: Vec3<T>, d_rho: T, grad: &mut [T]) {
        self.strength.scatter(&self.strength.stencil(x, UP.map(T::of)), self.d_strength(x, d_rho), grad);
    }
}

/// dLoss/d([`Clearcoat`]), laid out like the coefficients of its probes.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearcoatGradient<T> {
    /// With respect to the coefficients of [`Clearcoat::strength`].
    pub strength: Vec<T>,
    /// With respect to the coefficients of [`Clearcoat::radiance`].
    pub radiance: Vec<T>,
}
