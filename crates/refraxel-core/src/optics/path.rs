//! What a path is made of: segments, the steps that they came about by, and events on surfaces.

use crate::segment::Segment;
use crate::{Ray, Real, Vec3};

/// Most lattice steps of one visit to a region: what [`Step::lattice`] can count.
pub const MAX_LATTICE: u32 = u16::MAX as u32;

/// Cosine of the angle between the directions of a ray before and after a path up to which the path is straight [1]: 4.5 mrad; single
/// precision rounds to less.
pub const STRAIGHT: f64 = 1.0 - 1e-5;

/// How one segment of a path came about: the kick at its start, its length, and the event at its end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step<T> {
    /// Weight k of the force at the start of the segment, in t; 0 for none.
    pub kick: T,
    /// Length h in t to the next point, or τ to the surface, theory (2.24).
    pub drift: T,
    /// Steps of the lattice in this segment: 1, more for a hop in a flat part of a region, 0 for a hop outside.
    pub lattice: u16,
    /// The body on whose surface the event takes place; otherwise the region `within`.
    pub region: u16,
    /// The region that rules along the segment and whose field kicks; `None` in vacuum.
    pub within: Option<u16>,
    /// The event at the end of the segment, if that lies on a surface.
    pub event: Option<Event<T>>,
}

impl<T: Real> Step<T> {
    /// The region that rules after the step and its event; `None` in vacuum.
    pub fn leads_into(&self) -> Option<u16> {
        self.event.map_or(self.within, |event| event.next(self.within))
    }
}

/// What happens where a segment ends on the surface of a body, [`Step::region`]. The region on the side of the ray is
/// [`Step::within`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event<T> {
    /// Whether the ray passes.
    pub kind: EventKind,
    /// True if the ray comes from inside the body.
    pub from_inside: bool,
    /// The region that rules on the other side of the surface; `None` for vacuum.
    pub beyond: Option<u16>,
    /// The time u [in t] up to which the kicks of the lattice reach, theory (2.26): the end kick lasts from u to τ. `None`
    /// where the field is flat and needs no end kick. Held fixed in derivatives.
    pub kicked_until: Option<T>,
}

/// Whether a ray passes a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// It passes, by Snell's law.
    Refraction,
    /// It is turned back: total reflection.
    Reflection,
}

impl<T> Event<T> {
    /// The region that rules behind the surface for a ray with this kind of event.
    fn next(&self, within: Option<u16>) -> Option<u16> {
        match self.kind {
            EventKind::Refraction => self.beyond,
            EventKind::Reflection => within,
        }
    }
}

/// Why a path ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PathEnd {
    /// It left all regions for good.
    #[default]
    Escaped,
    /// It had [`Options::max_segments`](super::Options::max_segments) segments, 65 535 steps in one region, or found no way
    /// out of a body that rounding put it into. The rest of the path is missing.
    Exhausted,
}

/// A bent ray.
#[derive(Clone, Debug, PartialEq)]
pub struct Path<T> {
    /// The straight pieces, from the camera on.
    pub segments: Vec<Segment<T>>,
    /// How each segment came about; one per segment.
    pub steps: Vec<Step<T>>,
    /// The ray at its end, in vacuum: the end of the last segment and the unit direction there.
    pub exit: Ray<T>,
    /// Why it ended.
    pub end: PathEnd,
}

impl<T> Path<T> {
    /// The events on surfaces, from the camera on.
    pub fn events(&self) -> impl Iterator<Item = &Event<T>> {
        self.steps.iter().filter_map(|s| s.event.as_ref())
    }
}

impl<T: Real> Path<T> {
    /// Whether it is other than the straight `ray`: it meets a surface, or leaves in another direction.
    pub fn bends(&self, ray: &Ray<T>) -> bool {
        self.events().next().is_some() || ray.direction.dot(self.exit.direction) < T::of(STRAIGHT)
    }
}

impl<T: Real> Default for Path<T> {
    fn default() -> Self {
        let exit = Ray { origin: Vec3::zero(), direction: Vec3::zero() };
        Self { segments: Vec::new(), steps: Vec::new(), exit, end: PathEnd::Escaped }
    }
}
