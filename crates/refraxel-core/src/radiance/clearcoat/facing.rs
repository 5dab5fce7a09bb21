//! The surface of an opaque object and the share of light that a clearcoat on it mirrors, theory (7.13) and (7.14), with transposes.

use crate::optics::fresnel::Incidence;
use crate::{Real, Vec3};

/// Slope of the raw density [1 / voxel] at which half of the reflection is there: fog has no surface.
pub const LEAST_SLOPE: f64 = 0.25;
/// Cosine of the angle of incidence at which half of the reflection is there [1]: beyond it, at 87 degrees, the mean of the
/// normals in a pixel is no normal of anything.
pub const LEAST_COSINE: f64 = 0.05;

/// The surface that a ray ends at: sums over its samples with weights w = T a, theory (7.13).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing<T> {
    /// A = Σ w, how opaque the surface is [1].
    pub opacity: T,
    /// X = Σ w x / Σ w [scene unit].
    pub position: Vec3<T>,
    /// G = −h Σ w ∇θ, outwards [1 / voxel]; h is the edge of a voxel.
    pub slope: Vec3<T>,
}

/// The light that a clearcoat mirrors into a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearcoatReflection<T> {
    /// Share of the light that is mirrored, in [0, 1], for a strength of 1.
    pub share: T,
    /// Unit direction of the mirrored ray, away from the surface.
    pub direction: Vec3<T>,
    /// Unit normal m = G/|G|, outwards.
    pub normal: Vec3<T>,
}

/// dLoss/d(arguments of [`Facing::reflection`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacingAdjoint<T> {
    /// dLoss/d(facing); its position is 0, since the reflection does not depend on it.
    pub facing: Facing<T>,
    /// dLoss/dd, as a free vector.
    pub direction: Vec3<T>,
}

impl<T: Real> Facing<T> {
    /// The sums before the first sample.
    pub fn nothing() -> Self {
        Self { opacity: T::zero(), position: Vec3::zero(), slope: Vec3::zero() }
    }

    /// Adds a sample of weight `w` at `x` with h ∇θ = `slope`. The position is a sum until [`Self::finished`].
    #[inline(always)]
    pub fn add(&mut self, w: T, x: Vec3<T>, slope: Vec3<T>) {
        self.opacity += w;
        self.position += x * w;
        self.slope -= slope * w;
    }

    /// The mean position in place of the sum; `None` where the ray meets nothing.
    #[inline(always)]
    pub fn finished(mut self) -> Option<Self> {
        (self.opacity > T::zero()).then(|| {
            self.position = self.position / self.opacity;
            self
        })
    }

    /// The reflection of a ray in the unit direction `d` on a clearcoat of index `ior`, theory (7.14); `None` where the surface
    /// faces away or has no normal.
    #[inline(always)]
    pub fn reflection(&self, d: Vec3<T>, ior: T) -> Option<ClearcoatReflection<T>> {
        let square = self.slope.dot(self.slope);
        let normal = self.slope / square.sqrt();
        let cosine = -d.dot(normal);
        (square > T::zero() && cosine > T::zero()).then(|| {
            let steep = saturation(square, LEAST_SLOPE).value;
            let share = self.opacity * steep * saturation(cosine * cosine, LEAST_COSINE).value;
            let share = share * incidence(cosine, ior).reflectance();
            ClearcoatReflection { share, direction: d + normal * (T::of(2.0) * cosine), normal }
        })
    }

    /// Transpose of the derivative of [`Self::reflection`] by the surface and the ray, theory (7.15), given dLoss/dshare
    /// and dLoss/d(mirrored direction). Only where there is a reflection.
    #[inline(always)]
    pub fn reflection_vjp(&self, d: Vec3<T>, ior: T, d_share: T, d_direction: Vec3<T>) -> FacingAdjoint<T> {
        let two = T::of(2.0);
        let square = self.slope.dot(self.slope);
        let length = square.sqrt();
        let normal = self.slope / length;
        let cosine = -d.dot(normal);
        let (steep, oblique) = (saturation(square, LEAST_SLOPE), saturation(cosine * cosine, LEAST_COSINE));
        let at = incidence(cosine, ior);
        let reflectance = at.reflectance();
        // forward: share = A steep(G²) oblique(a²) R(a)
        let d_at = at.reflectance_vjp(d_share * self.opacity * steep.value * oblique.value);
        // forward: after² = n² − 1 + before²
        let mut d_cosine = d_at.before + d_at.after * cosine / at.after;
        d_cosine += d_share * self.opacity * steep.value * reflectance * oblique.slope * two * cosine;
        // forward: u = d + 2 a m
        d_cosine += two * normal.dot(d_direction);
        // forward: a = −d · m
        let d_normal = d_direction * (two * cosine) - d * d_cosine;
        // forward: m = G/|G|
        let along = normal * normal.dot(d_normal);
        let d_square = d_share * self.opacity * oblique.value * reflectance * steep.slope;
        let facing = Self {
            opacity: d_share * steep.value * oblique.value * reflectance,
            position: Vec3::zero(),
            slope: (d_normal - along) / length + self.slope * (two * d_square),
        };
        FacingAdjoint { facing, direction: d_direction - normal * d_cosine }
    }

    /// dLoss/dw of a sample at `x` with h ∇θ = `slope`, given dLoss/d(self), theory (7.16).
    #[inline(always)]
    pub fn d_weight(&self, d: &Self, x: Vec3<T>, slope: Vec3<T>) -> T {
        d.opacity + d.position.dot(x - self.position) / self.opacity - d.slope.dot(slope)
    }
}

/// A smooth step from 0 to 1, and its derivative.
struct Saturation<T> {
    value: T,
    slope: T,
}

/// s/(s + e²) of a square s, and its derivative by s: one half at s = e².
#[inline(always)]
fn saturation<T: Real>(square: T, least: f64) -> Saturation<T> {
    let floor = T::of(least * least);
    let sum = square + floor;
    Saturation { value: square / sum, slope: floor / (sum * sum) }
}

/// Light that arrives in vacuum at a clearcoat of index `ior`, at an angle of this cosine.
#[inline(always)]
pub(super) fn incidence<T: Real>(cosine: T, ior: T) -> Incidence<T> {
    let half = T::of(0.5);
    Incidence {
        before: cosine,
        after: (ior * ior - T::one() + cosine * cosine).sqrt(),
        w_before: half,
        w_after: half * ior * ior,
    }
}
