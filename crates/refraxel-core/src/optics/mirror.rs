//! What the surfaces on a path mirror beside what they let pass, theory (7.1)–(7.4), and its transpose.

use super::fresnel::{Incidence, Weight};
use super::gradual::Surface;
use super::{Event, Path, Step, Tracer};
use crate::index::VACUUM;
use crate::radiance::Segment;
use crate::{Real, Vec3};

/// The share of the light that a surface on a path mirrors, and where it comes from, theory (7.1) and (7.2).
///
/// One for each refraction at a sharp surface, and for each passage of a transition that is no lens, theory (7.11). Total
/// reflection has none: there the path itself is what is mirrored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartialReflection<T> {
    /// Which segment of the path ends here.
    pub segment: usize,
    /// Region of the surface.
    pub region: u16,
    /// True if the ray comes from inside, and the mirrored one stays there.
    pub from_inside: bool,
    /// The point on the surface.
    pub position: Vec3<T>,
    /// Unit direction of the mirrored ray.
    pub direction: Vec3<T>,
    /// Unit normal outwards: ∇φ/|∇φ|, or −∇w/|∇w|.
    pub normal: Vec3<T>,
    /// Unpolarised reflectance R ∈ [0, 1], or what [`Weight`] makes of it.
    pub reflectance: T,
}

/// dLoss/d([`PartialReflection`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartialReflectionAdjoint<T> {
    /// dLoss/dposition.
    pub position: Vec3<T>,
    /// dLoss/ddirection, as a free vector.
    pub direction: Vec3<T>,
    /// dLoss/dreflectance.
    pub reflectance: T,
}

impl<T: Real> Default for PartialReflectionAdjoint<T> {
    fn default() -> Self {
        Self { position: Vec3::zero(), direction: Vec3::zero(), reflectance: T::zero() }
    }
}

/// dLoss/d(what a turn at a surface is made of) that mirroring adds.
pub(super) struct MirrorAdjoint<T> {
    /// Of the position on the surface.
    pub x: Vec3<T>,
    /// Of the momentum on arrival.
    pub p: Vec3<T>,
    /// Of the unit normal.
    pub normal: Vec3<T>,
    /// Of the normal momenta before and after, with their signs.
    pub before: T,
    /// See `before`.
    pub after: T,
    /// Of w inside.
    pub w: T,
}

/// A ray that arrives at a surface and passes it.
pub(super) struct Arrival<T> {
    /// Momentum on arrival, after the end kick.
    pub p: Vec3<T>,
    /// ∇φ/|∇φ|.
    pub normal: Vec3<T>,
    /// p · m on arrival and beyond.
    pub before: T,
    /// See `before`.
    pub after: T,
    /// w inside.
    pub w: T,
    /// The ray comes from inside.
    pub from_inside: bool,
}

impl<T: Real> Arrival<T> {
    fn incidence(&self) -> Incidence<T> {
        let vacuum = T::of(VACUUM);
        let (w_before, w_after) = if self.from_inside { (self.w, vacuum) } else { (vacuum, self.w) };
        Incidence { before: self.before.abs(), after: self.after.abs(), w_before, w_after }
    }

    /// Unit direction and length of p − 2 (p · m) m.
    fn mirrored(&self) -> (Vec3<T>, T) {
        let q = self.p - self.normal * (self.before + self.before);
        let size = q.length();
        (q / size, size)
    }

    /// Transpose of reflectance and mirrored direction, theory (7.3) and (7.4).
    pub(super) fn vjp(&self, d: &PartialReflectionAdjoint<T>, weight: Weight) -> MirrorAdjoint<T> {
        let by = self.incidence().share_vjp(weight, d.reflectance);
        let (u, size) = self.mirrored();
        // forward: u = q/|q|, q = p − 2 a m
        let d_q = (d.direction - u * u.dot(d.direction)) / size;
        let two = T::of(2.0);
        MirrorAdjoint {
            x: d.position,
            p: d_q,
            normal: d_q * (-two * self.before),
            before: by.before * self.before.signum() - two * self.normal.dot(d_q),
            after: by.after * self.after.signum(),
            w: if self.from_inside { by.w_before } else { by.w_after },
        }
    }
}

impl<T: Real> Tracer<'_, T> {
    /// What the surfaces on a path mirror, sharp ones and transitions, from the camera on, into memory that is
    /// used again.
    pub fn partial_reflections(&self, path: &Path<T>, out: &mut Vec<PartialReflection<T>>) {
        out.clear();
        self.surfaces(path, |surface| {
            out.push(match surface {
                Surface::Sharp(segment) => self.at_event(path, segment),
                Surface::Smooth(passage) => passage.reflection(self.options.weight),
            })
        });
    }

    fn at_event(&self, path: &Path<T>, segment: usize) -> PartialReflection<T> {
        let (step, of) = (&path.steps[segment], &path.segments[segment]);
        let event = step.event.unwrap_or_else(|| unreachable!("a surface is met here"));
        let (position, arrival) = self.arrival((step, &event), of);
        PartialReflection {
            segment,
            region: step.region,
            from_inside: event.from_inside,
            position,
            direction: arrival.mirrored().0,
            normal: arrival.normal,
            reflectance: arrival.incidence().share(self.options.weight),
        }
    }

    fn arrival(&self, (step, event): (&Step<T>, &Event<T>), segment: &Segment<T>) -> (Vec3<T>, Arrival<T>) {
        let x = segment.at(step.drift);
        let (turn, p, w, _) = self.turn_at((step, event), (x, segment.momentum));
        let (normal, before, after) = (turn.normal, turn.before, turn.after);
        (x, Arrival { p, normal, before, after, w, from_inside: event.from_inside })
    }
}
