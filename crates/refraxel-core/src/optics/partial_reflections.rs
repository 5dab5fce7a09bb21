//! The partial reflections on a path, at sharp surfaces and smooth transitions, in the order in which the ray meets them.

use super::mirror::{PartialReflection, PartialReflectionAdjoint};
use super::path::{EventKind, Path};
use super::step::State;
use super::tracer::Tracer;
use super::transition::{Passage, Run};
use crate::segment::SegmentAdjoint;
use crate::{IndexGradient, Real};

/// A surface on a path that mirrors.
enum Surface<T> {
    /// The sharp surface at the end of the segment of this number.
    Sharp(usize),
    /// A smooth transition, at its steepest point.
    Smooth(Passage<T>),
}

impl<T: Real> Tracer<'_, T> {
    /// The partial reflections on a path, theory (7.1), (7.2) and (7.11), from the camera on. Replaces the content of `out`,
    /// whose memory is used again.
    ///
    /// Error at a smooth transition: 1 % of the reflectance of a sharp surface between the same indices.
    pub fn partial_reflections(&self, path: &Path<T>, out: &mut Vec<PartialReflection<T>>) {
        out.clear();
        self.surfaces(path, |surface| {
            out.extend(match surface {
                Surface::Sharp(segment) => self.at_event(path, segment),
                Surface::Smooth(passage) => Some(passage.reflection()),
            })
        });
    }

    /// The partial reflection at the sharp surface at the end of a segment; `None` if there is none.
    fn at_event(&self, path: &Path<T>, segment: usize) -> Option<PartialReflection<T>> {
        let (step, drift) = (&path.steps[segment], &path.segments[segment]);
        let event = step.event.as_ref()?;
        let at = self.impact(step, event, &State { x: drift.start, p: drift.momentum });
        let arrival = at.arrival(&event.turn(&at));
        Some(PartialReflection {
            segment,
            region: step.region,
            from_inside: event.from_inside,
            within: step.within,
            position: at.x,
            direction: arrival.direction(),
            normal: arrival.normal,
            reflectance: arrival.reflectance(),
        })
    }

    /// Calls `found` for each surface on a path that mirrors, from the camera on.
    fn surfaces(&self, path: &Path<T>, mut found: impl FnMut(Surface<T>)) {
        let (mut before, mut run) = (None, None::<Run<T>>);
        let any_smooth = self.has_smooth_regions();
        for (i, step) in path.steps.iter().enumerate() {
            if any_smooth {
                let point = self.point(path, i);
                let next = before.and_then(|before| Run::between(before, point));
                run = match (run, next) {
                    (Some(r), Some(n)) if r.rises == n.rises => Some(r.with(point)),
                    (ended, next) => {
                        self.close(path, ended, &mut found);
                        next
                    }
                };
                if self.smooth_region(path, i).is_none() {
                    self.close(path, run.take(), &mut found);
                }
                before = Some(point);
            }
            if step.event.is_some_and(|e| e.kind == EventKind::Refraction) {
                found(Surface::Sharp(i));
            }
        }
    }

    /// Reports the passage of a run of points that has ended, if it is one.
    fn close(&self, path: &Path<T>, run: Option<Run<T>>, found: &mut impl FnMut(Surface<T>)) {
        if let Some(passage) = run.and_then(|run| self.passage(path, run)) {
            found(Surface::Smooth(passage));
        }
    }

    /// Transpose of the partial reflections at smooth transitions, theory (7.12): adds to the adjoints of segments and to
    /// `grad`, and returns the adjoints of the others, at sharp surfaces.
    ///
    /// Which points a transition has is held fixed.
    ///
    /// # Panics
    /// If there are more adjoints than partial reflections.
    pub(super) fn smooth_reflections_vjp(
        &self,
        path: &Path<T>,
        d_reflections: &[PartialReflectionAdjoint<T>],
        d_segments: &mut [SegmentAdjoint<T>],
        grad: &mut impl IndexGradient<T>,
    ) -> Vec<PartialReflectionAdjoint<T>> {
        let (mut sharp, mut all) = (Vec::new(), d_reflections.iter());
        self.surfaces(path, |surface| match (surface, all.next()) {
            (_, None) => {}
            (Surface::Sharp(_), Some(d)) => sharp.push(*d),
            (Surface::Smooth(passage), Some(d)) => self.passage_vjp(path, &passage, d, d_segments, grad),
        });
        assert!(all.next().is_none(), "no more adjoints than partial reflections");
        sharp
    }
}
