//! What a smooth transition of the index mirrors, theory (7.11), and its transpose.

use super::fresnel::{Incidence, Weight};
use super::{EventKind, GRAZING, PartialReflection, PartialReflectionAdjoint, Path, Tracer};
use crate::index::VACUUM;
use crate::radiance::SegmentAdjoint;
use crate::{IndexGradient, IndexGrid, Real, Vec3};

/// Widest transition that is a surface [longest edge of the region]: the largest contrast of w in the region over the steepest
/// slope that the path meets. A longer one is a lens, and mirrors nothing.
const WIDEST: f64 = 0.125;
/// Weaker reflections are left out [1].
const LEAST: f64 = 1e-4;
/// Change of w from point to point below which the index is constant there [1].
const FLAT: f64 = 1e-4;
/// Contrast of w to vacuum above which a ray comes from inside a body [1].
const INSIDE: f64 = 0.01;

/// What a path meets that mirrors.
pub(super) enum Surface<T> {
    /// The sharp surface at the end of this segment.
    Sharp(usize),
    /// The steepest point of a transition.
    Smooth(Passage<T>),
}

/// A point of a path, which is the start of a segment: w and, in smooth regions, ∇w.
#[derive(Clone, Copy)]
struct Point<T> {
    index: usize,
    w: T,
    force: Vec3<T>,
}

/// The points of a path over which w rises, or falls, and the steepest one.
#[derive(Clone, Copy)]
struct Run<T> {
    rises: bool,
    first: Point<T>,
    steepest: Point<T>,
    last: Point<T>,
}

impl<T: Real> Run<T> {
    fn of(rises: bool, first: Point<T>, last: Point<T>) -> Self {
        Self { rises, first, steepest: first, last: first }.with(last)
    }

    fn with(mut self, last: Point<T>) -> Self {
        let steepness = |p: &Point<T>| p.force.dot(p.force);
        self.last = last;
        if steepness(&last) > steepness(&self.steepest) {
            self.steepest = last;
        }
        self
    }
}

/// A ray that passes a transition.
pub(super) struct Passage<T> {
    run: Run<T>,
    region: usize,
    /// The steepest point.
    x: Vec3<T>,
    /// Momentum behind the kick there.
    p: Vec3<T>,
    /// Unit normal there, towards the larger index.
    normal: Vec3<T>,
    /// Normal momenta and w on both sides.
    incidence: Incidence<T>,
}

impl<T: Real> Passage<T> {
    /// +1 towards the larger index, −1 away from it.
    fn sign(&self) -> T {
        if self.run.rises { T::one() } else { -T::one() }
    }

    /// Unit direction and length of what arrives, with its normal momentum turned round: q = p∥ ∓ a m.
    fn mirrored(&self) -> (Vec3<T>, T) {
        let parallel = self.p - self.normal * self.p.dot(self.normal);
        let q = parallel - self.normal * (self.incidence.before * self.sign());
        let size = q.length();
        (q / size, size)
    }

    pub(super) fn reflection(&self, weight: Weight) -> PartialReflection<T> {
        PartialReflection {
            segment: self.run.steepest.index - 1,
            region: self.region as u16,
            from_inside: self.incidence.w_before > T::of(VACUUM + INSIDE),
            position: self.x,
            direction: self.mirrored().0,
            normal: -self.normal,
            reflectance: self.incidence.share(weight),
        }
    }
}

impl<T: Real> Tracer<'_, T> {
    /// What a path meets that mirrors, from the camera on.
    pub(super) fn surfaces(&self, path: &Path<T>, mut found: impl FnMut(Surface<T>)) {
        let (mut before, mut run): (Option<Point<T>>, Option<Run<T>>) = (None, None);
        let any_smooth = self.has_smooth_regions();
        for (i, step) in path.steps.iter().enumerate() {
            if any_smooth {
                let point = self.point(path, i);
                let change =
                    before.filter(|b| (b.w - point.w).abs() > T::of(FLAT)).map(|b| (point.w > b.w, b));
                run = match (run, change) {
                    (Some(r), Some((rises, _))) if r.rises == rises => Some(r.with(point)),
                    (ended, change) => {
                        self.close(path, ended, &mut found);
                        change.map(|(rises, before)| Run::of(rises, before, point))
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

    fn close(&self, path: &Path<T>, run: Option<Run<T>>, found: &mut impl FnMut(Surface<T>)) {
        if let Some(passage) = run.and_then(|run| self.passage(path, run)) {
            found(Surface::Smooth(passage));
        }
    }

    /// Some region has no sharp surface.
    pub(super) fn has_smooth_regions(&self) -> bool {
        self.medium.regions().iter().any(|r| r.level_set().is_none())
    }

    /// The region without a sharp surface in which a point was marched through.
    fn smooth_region(&self, path: &Path<T>, point: usize) -> Option<(usize, &IndexGrid<T>)> {
        let step = &path.steps[point];
        let region = usize::from(step.region);
        let grid = self.medium.regions().get(region)?;
        (step.lattice > 0 && grid.level_set().is_none()).then_some((region, grid))
    }

    /// A point of a path; vacuum where no smooth region is marched through.
    fn point(&self, path: &Path<T>, index: usize) -> Point<T> {
        let x = path.segments[index].start;
        if let Some((_, grid)) = self.smooth_region(path, index) {
            let (w, force) = grid.sample(x);
            return Point { index, w, force };
        }
        let w = if index == 0 {
            // The camera may stand anywhere.
            let n = self.medium.index(x);
            T::of(0.5) * n * n
        } else {
            T::of(VACUUM)
        };
        Point { index, w, force: Vec3::zero() }
    }

    /// The passage of a run; `None` where the ray turns round, for lenses, and where next to nothing is mirrored.
    fn passage(&self, path: &Path<T>, run: Run<T>) -> Option<Passage<T>> {
        let (at, slope) = (run.steepest.index, run.steepest.force.length());
        let (region, grid) = self.smooth_region(path, at).filter(|_| at > 0 && slope > T::zero())?;
        let (p, normal) = (path.segments[at].momentum, run.steepest.force / slope);
        // The momentum of a hop is that with which it arrives.
        let is_hop = path.steps[run.first.index].lattice == 0;
        let arriving = path.segments[run.first.index.saturating_sub(usize::from(!is_hop))].momentum;
        let leaving = path.segments[run.last.index].momentum;
        let goes_on = |p: Vec3<T>| (p.dot(normal) > T::zero()) == run.rises;
        if ![arriving, p, leaving].into_iter().all(goes_on) {
            return None;
        }
        let (largest, half) = (grid.largest_index(), T::of(0.5));
        let contrast = (half * largest * largest - T::of(VACUUM)).abs();
        if contrast > T::of(WIDEST) * grid.domain().bounds.extent().max_element() * slope {
            return None;
        }
        let tangential = p.dot(p) - p.dot(normal) * p.dot(normal);
        let square = |w: T| Some(w + w - tangential).filter(|s| *s > T::of(GRAZING * GRAZING) * (w + w));
        let (w_before, w_after) = (run.first.w, run.last.w);
        let (before, after) = (square(w_before)?.sqrt(), square(w_after)?.sqrt());
        let incidence = Incidence { before, after, w_before, w_after };
        let x = path.segments[at].start;
        (incidence.reflectance() > T::of(LEAST)).then_some(Passage { run, region, x, p, normal, incidence })
    }

    /// Transpose of what transitions mirror: adds to the adjoints of segments and to `grad`, and returns what is left, the
    /// adjoints of sharp surfaces. Which points a transition has is held fixed.
    pub(super) fn gradual_vjp(
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

    fn passage_vjp(
        &self,
        path: &Path<T>,
        at: &Passage<T>,
        d: &PartialReflectionAdjoint<T>,
        d_segments: &mut [SegmentAdjoint<T>],
        grad: &mut impl IndexGradient<T>,
    ) {
        let (p, m, sign, two) = (at.p, at.normal, at.sign(), T::of(2.0));
        let along = p.dot(m);
        // forward: u = q/|q|, q = p − (p·m) m ∓ a m
        let (u, size) = at.mirrored();
        let d_q = (d.direction - u * u.dot(d.direction)) / size;
        let by = at.incidence.share_vjp(self.options.weight, d.reflectance);
        let (d_before, d_after) = (by.before - sign * m.dot(d_q), by.after);
        // forward: a² = 2 w₀ − t, s² = 2 w₁ − t, t = p² − (p·m)²
        let (by_before, by_after) = (d_before / at.incidence.before, d_after / at.incidence.after);
        let d_t = -(by_before + by_after) / two;
        let d_p = d_q - m * m.dot(d_q) + (p - m * along) * (two * d_t);
        let d_m = -(d_q * (along + sign * at.incidence.before)) - p * (m.dot(d_q) + two * along * d_t);
        // forward: m = ∇w/|∇w|
        let d_force = (d_m - m * m.dot(d_m)) / at.run.steepest.force.length();
        let grid = &self.medium.regions()[at.region];
        grad.add((at.region, grid), at.x, (T::zero(), d_force));
        let (_, by_force) = grid.gradient_pullback(at.x, d_force);
        let own = &mut d_segments[at.run.steepest.index];
        own.0 += d.position + by_force;
        own.1 += d_p;
        for (point, d_w) in [(at.run.first, by.w_before + by_before), (at.run.last, by.w_after + by_after)] {
            if let Some((region, grid)) = self.smooth_region(path, point.index) {
                let x = path.segments[point.index].start;
                grad.add((region, grid), x, (d_w, Vec3::zero()));
                d_segments[point.index].0 += grid.w_gradient(x) * d_w;
            }
        }
    }
}
