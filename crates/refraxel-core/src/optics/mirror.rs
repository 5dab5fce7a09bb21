//! The light that a sharp surface mirrors while the ray passes, theory (7.1) and (7.2), and its transpose, theory (7.3) and
//! (7.4).

use super::fresnel::Incidence;
use super::sides::Sides;
use crate::{Real, Vec3};

/// The share of the light that a surface on a path mirrors, and the ray along which that light arrives, theory (7.1) and
/// (7.2).
///
/// There is one for each refraction at a sharp surface, and one for each smooth transition that counts as a surface,
/// theory (7.11). Total reflection has none: there the path itself follows the mirrored ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartialReflection<T> {
    /// Number of the segment of the path that ends on the surface.
    pub segment: usize,
    /// Number of the region that the surface belongs to.
    pub region: u16,
    /// True if the ray comes from inside that body.
    pub from_inside: bool,
    /// The region in which the ray arrives and the mirrored ray stays; `None` for vacuum. Where bodies lie in each other this
    /// may be another than `region`: a bubble in glass mirrors the glass around it.
    pub within: Option<u16>,
    /// The point on the surface [scene unit].
    pub position: Vec3<T>,
    /// Unit direction of the mirrored ray, away from the surface.
    pub direction: Vec3<T>,
    /// Unit normal, out of the body: ∇φ/|∇φ|, or −∇w/|∇w|.
    pub normal: Vec3<T>,
    /// The mirrored share of the light, in [0, 1]: Fresnel's reflectance R, theory (7.1).
    pub reflectance: T,
}

/// dLoss/d([`PartialReflection`]).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartialReflectionAdjoint<T> {
    /// dLoss/dposition [1 / scene unit].
    pub position: Vec3<T>,
    /// dLoss/ddirection [1], as a free vector.
    pub direction: Vec3<T>,
    /// dLoss/dreflectance [1].
    pub reflectance: T,
}

/// A ray that arrives at a sharp surface and passes it.
pub(super) struct Arrival<T> {
    /// Momentum on arrival, after the end kick.
    pub p: Vec3<T>,
    /// Unit normal m = ∇φ/|∇φ|.
    pub normal: Vec3<T>,
    /// a = p · m, with its sign.
    pub before: T,
    /// s = p' · m of the refracted ray, with its sign.
    pub after: T,
    /// w on both sides.
    pub w: Sides<T>,
}

/// dLoss/d([`Arrival`]) of a partial reflection, which the transpose of the event adds to its own terms.
pub(super) struct MirrorAdjoint<T> {
    /// dLoss/d(point on the surface).
    pub x: Vec3<T>,
    /// dLoss/dp.
    pub p: Vec3<T>,
    /// dLoss/dm.
    pub normal: Vec3<T>,
    /// dLoss/da.
    pub before: T,
    /// dLoss/ds.
    pub after: T,
    /// dLoss/dw on both sides.
    pub w: Sides<T>,
}

impl<T: Real> Arrival<T> {
    /// Normal momenta and w on both sides.
    fn incidence(&self) -> Incidence<T> {
        let Sides { before: w_before, after: w_after } = self.w;
        Incidence { before: self.before.abs(), after: self.after.abs(), w_before, w_after }
    }

    /// The mirrored share of the light, theory (7.1).
    pub(super) fn reflectance(&self) -> T {
        self.incidence().reflectance()
    }

    /// q = p − 2 (p · m) m, the momentum of the mirrored ray, theory (7.2).
    fn mirrored(&self) -> Vec3<T> {
        self.p - self.normal * (self.before + self.before)
    }

    /// Unit direction u = q/|q| of the mirrored ray, theory (7.2).
    pub(super) fn direction(&self) -> Vec3<T> {
        let q = self.mirrored();
        q / q.length()
    }

    /// Transpose of [`Self::reflectance`] and [`Self::direction`], theory (7.3) and (7.4).
    pub(super) fn vjp(&self, d: &PartialReflectionAdjoint<T>) -> MirrorAdjoint<T> {
        let by = self.incidence().reflectance_vjp(d.reflectance);
        let q = self.mirrored();
        let size = q.length();
        let u = q / size;
        // forward: u = q/|q|, q = p − 2 a m
        let d_q = (d.direction - u * u.dot(d.direction)) / size;
        let two = T::of(2.0);
        MirrorAdjoint {
            x: d.position,
            p: d_q,
            normal: d_q * (-two * self.before),
            before: by.before * self.before.signum() - two * self.normal.dot(d_q),
            after: by.after * self.after.signum(),
            w: Sides { before: by.w_before, after: by.w_after },
        }
    }
}
