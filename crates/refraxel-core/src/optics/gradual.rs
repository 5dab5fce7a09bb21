//! What a smooth transition of the index mirrors, theory (7.11), and its transpose.

use super::fresnel::{Incidence, Weight};
use super::{EventKind, GRAZING, PartialReflection, PartialReflectionAdjoint, Path, Tracer};
use crate::index::VACUUM;
use crate::radiance::SegmentAdjoint;
use crate::{IndexGradient, IndexGrid, Real, Vec3};

/// Widest transition that is a surface [longest edge of the region]: Δw over the steepest slope. A longer one is a lens, and
/// mirrors nothing.
const WIDEST: f64 = 0.125;
/// Weaker reflections are left out [1].
const LEAST: f64 = 1e-4;

/// What a path meets that mirrors.
pub(super) enum Surface<T> {
    /// The sharp surface at the end of this segment.
    Sharp(usize),
    /// The steepest point of a transition.
    Smooth(Passage<T>),
}

/// The points of a path over which w rises, or falls. A point is the start of a segment.
#[derive(Clone, Copy)]
struct Run {
    rises: bool,
    first: usize,
    last: usize,
}

/// A ray that passes a transition.
pub(super) struct Passage<T> {
    run: Run,
    /// The point where |∇w| is largest, and the region.
    steepest: usize,
    region: usize,
    x: Vec3<T>,
    /// Momentum behind the kick there.
    p: Vec3<T>,
    /// ∇w, and the normal towards the larger index.
    force: Vec3<T>,
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
            segment: self.steepest - 1,
            region: self.region as u16,
            from_inside: !self.run.rises,
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
        let mut before: Option<T> = None;
        let mut run: Option<Run> = None;
        let any_smooth = self.has_smooth_regions();
        for (i, step) in path.steps.iter().enumerate() {
            if any_smooth {
                let w = self.level(path, i);
                let rises = before.filter(|b| *b != w).map(|b| w > b);
                match (&mut run, rises) {
                    (Some(r), Some(rises)) if r.rises == rises => r.last = i,
                    _ => {
                        run.take().and_then(|r| self.passage(path, r)).map(Surface::Smooth).map(&mut found);
                        run = rises.map(|rises| Run { rises, first: i - 1, last: i });
                    }
                }
                before = Some(w);
                if self.smooth_region(path, i).is_none() {
                    run.take().and_then(|r| self.passage(path, r)).map(Surface::Smooth).map(&mut found);
                }
            }
            if step.event.is_some_and(|e| e.kind == EventKind::Refraction) {
                found(Surface::Sharp(i));
            }
        }
    }

    /// Some region has no sharp surface.
    pub(super) fn has_smooth_regions(&self) -> bool {
        self.medium.regions().iter().any(|r| r.level_set().is_none())
    }

    /// The region without a sharp surface in which a point was marched through.
    fn smooth_region(&self, path: &Path<T>, point: usize) -> Option<(usize, &IndexGrid<T>)> {
        let step = &path.steps[point];
        let (region, grid) = (usize::from(step.region), self.medium.regions().get(usize::from(step.region))?);
        (step.lattice > 0 && grid.level_set().is_none()).then_some((region, grid))
    }

    /// w at a point; vacuum where no smooth region is.
    fn level(&self, path: &Path<T>, point: usize) -> T {
        let of = |(_, grid): (_, &IndexGrid<T>)| grid.sample(path.segments[point].start).0;
        self.smooth_region(path, point).map_or(T::of(VACUUM), of)
    }

    /// The passage of a run; `None` where the ray turns round, for lenses, and where next to nothing is mirrored.
    fn passage(&self, path: &Path<T>, run: Run) -> Option<Passage<T>> {
        let force = |i: usize| {
            let force = |(_, grid): (_, &IndexGrid<T>)| grid.sample(path.segments[i].start).1;
            self.smooth_region(path, i).map_or(Vec3::zero(), force)
        };
        let mut steepest = (run.first, Vec3::zero(), T::zero());
        for i in run.first..=run.last {
            let force = force(i);
            let square = force.dot(force);
            if square > steepest.2 {
                steepest = (i, force, square);
            }
        }
        let (steepest, force, square) = steepest;
        let (region, grid) =
            self.smooth_region(path, steepest).filter(|_| steepest > 0 && square > T::zero())?;
        let (p, normal) = (path.segments[steepest].momentum, force.normalized());
        let arriving = path.segments[run.first.saturating_sub(1)].momentum;
        let leaving = path.segments[run.last].momentum;
        let goes_on = |p: Vec3<T>| (p.dot(normal) > T::zero()) == run.rises;
        if ![arriving, p, leaving].into_iter().all(goes_on) {
            return None;
        }
        let (w_before, w_after) = (self.level(path, run.first), self.level(path, run.last));
        let widest = T::of(WIDEST) * grid.domain().bounds.extent().max_element();
        if (w_after - w_before).abs() > widest * square.sqrt() {
            return None;
        }
        let tangential = p.dot(p) - p.dot(normal) * p.dot(normal);
        let square = |w: T| Some(w + w - tangential).filter(|s| *s > T::of(GRAZING * GRAZING) * (w + w));
        let (before, after) = (square(w_before)?.sqrt(), square(w_after)?.sqrt());
        let incidence = Incidence { before, after, w_before, w_after };
        let x = path.segments[steepest].start;
        (incidence.reflectance() > T::of(LEAST)).then_some(Passage {
            run,
            steepest,
            region,
            x,
            p,
            force,
            normal,
            incidence,
        })
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
        let d_force = (d_m - m * m.dot(d_m)) / at.force.length();
        let grid = &self.medium.regions()[at.region];
        grad.add((at.region, grid), at.x, (T::zero(), d_force));
        let (_, by_force) = grid.gradient_pullback(at.x, d_force);
        let own = &mut d_segments[at.steepest];
        own.0 += d.position + by_force;
        own.1 += d_p;
        for (point, d_w) in [(at.run.first, by.w_before + by_before), (at.run.last, by.w_after + by_after)] {
            if let Some((region, grid)) = self.smooth_region(path, point) {
                let x = path.segments[point].start;
                grad.add((region, grid), x, (d_w, Vec3::zero()));
                d_segments[point].0 += grid.w_gradient(x) * d_w;
            }
        }
    }
}
