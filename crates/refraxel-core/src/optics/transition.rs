//! A smooth transition of the index that counts as one surface, theory (7.11), and its transpose, theory (7.12).

use super::event::GRAZING;
use super::fresnel::Incidence;
use super::mirror::{PartialReflection, PartialReflectionAdjoint};
use super::path::Path;
use super::tracer::Tracer;
use crate::index::VACUUM;
use crate::segment::SegmentAdjoint;
use crate::{IndexGradient, IndexGrid, Real, Vec3};

/// Widest transition that is a surface [longest edge of the region]: the largest contrast of w in the region over the
/// steepest slope that the path meets. A wider one is a lens, which has no surface.
const WIDEST: f64 = 0.125;
/// Reflectance below which a transition is left out [1].
pub const LEAST: f64 = 1e-4;
/// Change of w from point to point below which the index counts as constant there [1].
pub const FLAT: f64 = 1e-4;
/// Contrast of w to vacuum above which a ray comes from inside a body [1].
pub const INSIDE: f64 = 0.01;

/// A point of a path, which is the start of a segment.
#[derive(Clone, Copy)]
pub(super) struct Point<T> {
    /// Number of the segment.
    index: usize,
    /// w [1].
    w: T,
    /// ∇w [1 / scene unit]; 0 outside smooth regions.
    force: Vec3<T>,
}

/// Consecutive points of a path over which w rises, or over which it falls.
#[derive(Clone, Copy)]
pub(super) struct Run<T> {
    /// True if w rises along the ray.
    pub rises: bool,
    first: Point<T>,
    /// The point of the largest |∇w|.
    steepest: Point<T>,
    last: Point<T>,
}

impl<T: Real> Run<T> {
    /// The run from a point to the next; `None` where w changes by less than [`FLAT`].
    pub(super) fn between(first: Point<T>, last: Point<T>) -> Option<Self> {
        let changes = (first.w - last.w).abs() > T::of(FLAT);
        changes.then(|| Self { rises: last.w > first.w, first, steepest: first, last: first }.with(last))
    }

    /// The run with one more point at its end.
    pub(super) fn with(mut self, last: Point<T>) -> Self {
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
    /// Number of the region.
    region: usize,
    /// The steepest point [scene unit].
    x: Vec3<T>,
    /// Momentum behind the kick there.
    p: Vec3<T>,
    /// Unit normal m = ∇w/|∇w| there, towards the larger index.
    normal: Vec3<T>,
    /// Normal momenta a, s and w on both sides of the transition.
    incidence: Incidence<T>,
}

impl<T: Real> Passage<T> {
    /// +1 towards the larger index, −1 away from it.
    fn sign(&self) -> T {
        if self.run.rises { T::one() } else { -T::one() }
    }

    /// q = p − (p · m) m ∓ a m, theory (7.11): the momentum on arrival with its normal part turned round.
    fn mirrored(&self) -> Vec3<T> {
        let parallel = self.p - self.normal * self.p.dot(self.normal);
        parallel - self.normal * (self.incidence.before * self.sign())
    }

    /// The partial reflection at the transition, theory (7.11).
    pub(super) fn reflection(&self) -> PartialReflection<T> {
        let q = self.mirrored();
        let from_inside = self.incidence.w_before > T::of(VACUUM + INSIDE);
        PartialReflection {
            segment: self.run.steepest.index - 1,
            region: self.region as u16,
            from_inside,
            within: from_inside.then_some(self.region as u16),
            position: self.x,
            direction: q / q.length(),
            normal: -self.normal,
            reflectance: self.incidence.reflectance(),
        }
    }
}

impl<T: Real> Tracer<'_, T> {
    /// True if some region has no sharp surface.
    pub(super) fn has_smooth_regions(&self) -> bool {
        self.medium.regions().iter().any(|r| r.level_set().is_none())
    }

    /// The region without a sharp surface in which a point of a path was marched through.
    pub(super) fn smooth_region(&self, path: &Path<T>, point: usize) -> Option<(usize, &IndexGrid<T>)> {
        let step = &path.steps[point];
        let region = usize::from(step.within?);
        let grid = &self.medium.regions()[region];
        (step.lattice > 0 && grid.level_set().is_none()).then_some((region, grid))
    }

    /// A point of a path; vacuum where no smooth region is marched through.
    pub(super) fn point(&self, path: &Path<T>, index: usize) -> Point<T> {
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

    /// The passage of a run of points. `None` where the ray turns round (total reflection), at grazing incidence, for
    /// lenses, and where the reflectance is below [`LEAST`].
    pub(super) fn passage(&self, path: &Path<T>, run: Run<T>) -> Option<Passage<T>> {
        let (at, slope) = (run.steepest.index, run.steepest.force.length());
        let (region, grid) = self.smooth_region(path, at).filter(|_| at > 0 && slope > T::zero())?;
        let (x, p, normal) =
            (path.segments[at].start, path.segments[at].momentum, run.steepest.force / slope);
        if !goes_on(path, &run, p, normal) || is_lens(grid, slope) {
            return None;
        }
        let tangential = p.dot(p) - p.dot(normal) * p.dot(normal);
        let square = |w: T| Some(w + w - tangential).filter(|s| *s > T::of(GRAZING * GRAZING) * (w + w));
        let (w_before, w_after) = (run.first.w, run.last.w);
        let (before, after) = (square(w_before)?.sqrt(), square(w_after)?.sqrt());
        let incidence = Incidence { before, after, w_before, w_after };
        (incidence.reflectance() > T::of(LEAST)).then_some(Passage { run, region, x, p, normal, incidence })
    }

    /// Transpose of [`Passage::reflection`], theory (7.12): adds to the adjoints of the segments that begin at the points
    /// of the passage, and to `grad`. Which points these are is held fixed.
    pub(super) fn passage_vjp(
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
        let q = at.mirrored();
        let size = q.length();
        let u = q / size;
        let d_q = (d.direction - u * u.dot(d.direction)) / size;
        let by = at.incidence.reflectance_vjp(d.reflectance);
        let (d_before, d_after) = (by.before - sign * m.dot(d_q), by.after);
        // forward: a² = 2 w₀ − t, s² = 2 w₁ − t, t = p² − (p·m)²
        let (by_before, by_after) = (d_before / at.incidence.before, d_after / at.incidence.after);
        let d_t = -(by_before + by_after) / two;
        let d_p = d_q - m * m.dot(d_q) + (p - m * along) * (two * d_t);
        let d_m = -(d_q * (along + sign * at.incidence.before)) - p * (m.dot(d_q) + two * along * d_t);
        // forward: m = ∇w/|∇w|
        let d_force = (d_m - m * m.dot(d_m)) / at.run.steepest.force.length();
        let grid = &self.medium.regions()[at.region];
        grad.add(at.region, grid, at.x, T::zero(), d_force);
        let by_force = grid.gradient_pullback(at.x, d_force);
        let own = &mut d_segments[at.run.steepest.index];
        own.start += d.position + by_force;
        own.momentum += d_p;
        for (point, d_w) in [(at.run.first, by.w_before + by_before), (at.run.last, by.w_after + by_after)] {
            if let Some((region, grid)) = self.smooth_region(path, point.index) {
                let x = path.segments[point.index].start;
                grad.add(region, grid, x, d_w, Vec3::zero());
                d_segments[point.index].start += grid.w_gradient(x) * d_w;
            }
        }
    }
}

/// True if the ray moves along ∇w, or against it, all through a run: before it, at the steepest point, where its momentum
/// is `p`, and after it.
fn goes_on<T: Real>(path: &Path<T>, run: &Run<T>, p: Vec3<T>, normal: Vec3<T>) -> bool {
    // The momentum of a hop is that with which it arrives.
    let is_hop = path.steps[run.first.index].lattice == 0;
    let arriving = path.segments[run.first.index.saturating_sub(usize::from(!is_hop))].momentum;
    let leaving = path.segments[run.last.index].momentum;
    [arriving, p, leaving].into_iter().all(|p| (p.dot(normal) > T::zero()) == run.rises)
}

/// True if a transition of this steepest `slope` of w [1 / scene unit] is wider than [`WIDEST`].
fn is_lens<T: Real>(grid: &IndexGrid<T>, slope: T) -> bool {
    slope < gentlest(grid)
}

/// Slope of w [1 / scene unit] below which the steepest point of a transition is that of a lens.
pub fn gentlest<T: Real>(grid: &IndexGrid<T>) -> T {
    let (largest, half) = (grid.largest_index(), T::of(0.5));
    let contrast = (half * largest * largest - T::of(VACUUM)).abs();
    contrast / (T::of(WIDEST) * grid.domain().bounds.extent().max_element())
}
