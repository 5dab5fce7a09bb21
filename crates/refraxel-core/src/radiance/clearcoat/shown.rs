//! The reference renderer of a field under a clearcoat, and its transpose, theory (7.5), (7.6) and (7.13)–(7.16).

use super::coat::{Clearcoat, ClearcoatGradient};
use super::facing::{ClearcoatReflection, Facing};
use crate::field::{FieldGradient, Matter, VoxelField};
use crate::radiance::light::{mix, mix_vjp};
use crate::radiance::quadrature::QuadraturePoint;
use crate::segment::Segment;
use crate::{Ray, Real, Vec3, sh};

/// A field, the clearcoat of the opaque objects in it, and the colour behind both, which a
/// straight ray meets.
#[derive(Clone, Copy, Debug)]
pub struct ClearcoatedScene<'a, T: Copy> {
    /// The field.
    pub field: &'a VoxelField<T>,
    /// The clearcoat.
    pub clearcoat: &'a Clearcoat<T>,
    /// Colour of the background along the ray (sRGB-encoded, 1 = white).
    pub behind: [T; 3],
}

/// A sample of the field on a ray.
pub(super) struct Sample<T> {
    x: Vec3<T>,
    /// Length of the step [scene unit].
    ds: T,
    /// Opacity a of the step.
    alpha: T,
    /// Transmittance T in front of the step.
    before: T,
    colour: [T; 3],
    /// h ∇θ [1 / voxel].
    slope: Vec3<T>,
}

impl<T: Real> Sample<T> {
    /// w = T a.
    fn weight(&self) -> T {
        self.before * self.alpha
    }
}

/// The surface that a ray ends at, and what its clearcoat mirrors.
struct Coating<T> {
    facing: Facing<T>,
    reflection: ClearcoatReflection<T>,
}

/// The surface that a ray ends at, with dLoss/d(that surface).
struct SurfaceAdjoint<T> {
    facing: Facing<T>,
    d: Facing<T>,
}

impl<T: Real> ClearcoatedScene<'_, T> {
    /// The colour of a straight ray, theory (7.5) with the share of (7.14): the field before the background, and the
    /// mirrored light over both.
    ///
    /// `points` are those of [`quadrature`](crate::radiance::quadrature) on the one segment of the ray. Colours are
    /// sRGB-encoded.
    pub fn shown(&self, ray: &Ray<T>, points: &[QuadraturePoint<T>]) -> [T; 3] {
        let Some(segment) = Segment::straight(ray, &self.field.domain, T::zero()) else { return self.behind };
        let samples = samples(self.field, &segment, points);
        let plain = over(&samples, self.behind);
        let Some(Coating { facing, reflection }) = self.coating(ray, &samples) else { return plain };
        let radiance = &self.clearcoat.radiance;
        let mirrored = radiance.radiance(&radiance.stencil(facing.position, reflection.direction));
        mix(self.clearcoat.strength_at(facing.position) * reflection.share, mirrored, plain)
    }

    /// Transpose of the derivative of [`Self::shown`] by the field and the clearcoat, theory (7.6), (7.15) and (7.16): adds
    /// to both gradients, given dLoss/d(colour).
    ///
    /// The points are held fixed. Not differentiable where [`VoxelField::at_vjp`] is not, and where the surface begins to
    /// face away.
    pub fn shown_vjp(
        &self,
        ray: &Ray<T>,
        points: &[QuadraturePoint<T>],
        d_shown: [T; 3],
        grad: &mut FieldGradient<T>,
        d_clearcoat: &mut ClearcoatGradient<T>,
    ) {
        let Some(segment) = Segment::straight(ray, &self.field.domain, T::zero()) else { return };
        let samples = samples(self.field, &segment, points);
        let Some(coating) = self.coating(ray, &samples) else {
            return self.samples_vjp(ray, &samples, None, d_shown, grad);
        };
        let plain = over(&samples, self.behind);
        let (surface, d_plain) = self.coating_vjp(ray, &coating, plain, d_shown, d_clearcoat);
        self.samples_vjp(ray, &samples, Some(&surface), d_plain, grad);
    }

    /// The surface of a ray and its reflection; `None` where nothing is mirrored.
    fn coating(&self, ray: &Ray<T>, samples: &[Sample<T>]) -> Option<Coating<T>> {
        let facing = facing(samples)?;
        let reflection = facing.reflection(ray.direction, self.clearcoat.ior)?;
        Some(Coating { facing, reflection })
    }

    /// Transpose of the mixture of mirrored light and the `plain` colour of the field: the adjoint of the surface and
    /// dLoss/dplain. Adds to `d_clearcoat`.
    fn coating_vjp(
        &self,
        ray: &Ray<T>,
        Coating { facing, reflection }: &Coating<T>,
        plain: [T; 3],
        d_shown: [T; 3],
        d_clearcoat: &mut ClearcoatGradient<T>,
    ) -> (SurfaceAdjoint<T>, [T; 3]) {
        let Clearcoat { ior, radiance, .. } = self.clearcoat;
        let stencil = radiance.stencil(facing.position, reflection.direction);
        let (mirrored, rho) = (radiance.radiance(&stencil), self.clearcoat.strength_at(facing.position));
        // forward: shown = mix(ρ share, mirrored, plain)
        let d = mix_vjp(rho * reflection.share, mirrored, plain, d_shown);
        let d_rho = d.share * reflection.share;
        radiance.scatter(&stencil, d.mirrored, &mut d_clearcoat.radiance);
        self.clearcoat.scatter_strength(facing.position, d_rho, &mut d_clearcoat.strength);
        let (d_x, d_direction) = radiance.radiance_vjp(&stencil, reflection.direction, d.mirrored);
        let mut d_facing = facing.reflection_vjp(ray.direction, *ior, d.share * rho, d_direction).facing;
        d_facing.position = d_x + self.clearcoat.strength_vjp(facing.position, d_rho);
        (SurfaceAdjoint { facing: *facing, d: d_facing }, d.behind)
    }

    /// Transpose of the samples of a ray, back to front, theory (3.10)–(3.13) and (7.16), given dLoss/d(plain colour) and
    /// the adjoint of the surface, if there is one. Adds to `grad`.
    fn samples_vjp(
        &self,
        ray: &Ray<T>,
        samples: &[Sample<T>],
        surface: Option<&SurfaceAdjoint<T>>,
        d_plain: [T; 3],
        grad: &mut FieldGradient<T>,
    ) {
        let y = sh::basis(self.field.degree, ray.direction);
        // What lies behind a sample: its colour, and its dLoss/dw as one more colour channel that is black at the end.
        let (mut behind, mut d_weight_behind) = (self.behind, T::zero());
        for s in samples.iter().rev() {
            let d_weight = surface.map_or(T::zero(), |a| a.facing.d_weight(&a.d, s.x, s.slope));
            let mut contrast = d_weight - d_weight_behind;
            let mut d_colour = [T::zero(); 3];
            for c in 0..3 {
                contrast += d_plain[c] * (s.colour[c] - behind[c]);
                d_colour[c] = d_plain[c] * s.before * s.alpha;
                behind[c] += s.alpha * (s.colour[c] - behind[c]);
            }
            d_weight_behind += s.alpha * (d_weight - d_weight_behind);
            let d_tau = s.before * (T::one() - s.alpha) * contrast;
            self.field.at_vjp(s.x, &y, &Matter { density: d_tau * s.ds, colour: d_colour }, grad);
            if let Some(SurfaceAdjoint { d, .. }) = surface {
                self.field.raw_slope_vjp(s.x, d.slope * -s.weight(), grad);
            }
        }
    }
}

/// The samples of a straight ray, front to back, without those outside the field.
pub(super) fn samples<T: Real>(
    field: &VoxelField<T>,
    segment: &Segment<T>,
    points: &[QuadraturePoint<T>],
) -> Vec<Sample<T>> {
    let y = sh::basis(field.degree, segment.momentum);
    let mut before = T::one();
    let mut out = Vec::new();
    for q in points {
        let x = segment.at(q.t);
        let Some(matter) = field.at(x, &y) else { continue };
        let alpha = -(-matter.density * q.dt).exp_m1();
        let slope = field.raw_slope(x);
        out.push(Sample { x, ds: q.dt, alpha, before, colour: matter.colour, slope });
        before *= T::one() - alpha;
    }
    out
}

/// The surface that a ray ends at, theory (7.13).
pub(super) fn facing<T: Real>(samples: &[Sample<T>]) -> Option<Facing<T>> {
    let mut sum = Facing::nothing();
    samples.iter().for_each(|s| sum.add(s.weight(), s.x, s.slope));
    sum.finished()
}

/// The samples before a colour, theory (3.10).
fn over<T: Real>(samples: &[Sample<T>], mut behind: [T; 3]) -> [T; 3] {
    for s in samples.iter().rev() {
        for c in 0..3 {
            behind[c] += s.alpha * (s.colour[c] - behind[c]);
        }
    }
    behind
}
