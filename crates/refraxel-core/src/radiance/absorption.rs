//! The light that bodies absorb along a path, theory (7.17)–(7.20): its optical thickness at every point, and the transpose.

use super::light::Filter;
use crate::optics::Step;
use crate::segment::SegmentAdjoint;
use crate::{IndexGrid, Medium, Path, Real};

/// Optical thickness along a path, theory (7.17): how much is absorbed between the camera and a point of the path, per
/// channel. Memory that is used again for the next path.
#[derive(Clone, Debug, Default)]
pub struct Absorption<T> {
    /// Per segment: thickness at its start [1], and its growth in t [1 / scene unit]. One more at the end, without growth.
    along: Vec<[[T; 3]; 2]>,
}

/// dLoss/d(optical thickness) of points on a path: what [`Self::vjp`] hands to the path and to the coefficients.
#[derive(Clone, Debug, Default)]
pub struct AbsorptionAdjoint<T> {
    /// Per segment: the sum over its points, and the sum of t times that. One more for the end of the path.
    sums: Vec<[[T; 3]; 2]>,
}

/// The arc length within the body of a segment by t, and its derivative by |p|: the length is |p| t times the share g of
/// the body, theory (7.17).
struct Reach<T> {
    region: usize,
    by_t: T,
    by_speed: T,
}

impl<T: Real> Reach<T> {
    /// Of one segment; `None` in vacuum.
    fn of(medium: &Medium<T>, step: &Step<T>, speed: T) -> Option<Self> {
        let region = usize::from(step.within?);
        let [share, slope] = share(&medium.regions()[region], speed);
        Some(Self { region, by_t: speed * share, by_speed: share + speed * slope })
    }
}

/// Least difference between the largest index of a smooth region and that of vacuum [1] in the share of the body, theory (7.17).
pub const LEAST_CONTRAST: f64 = 0.01;

/// Share g of the body where the index is n, and dg/dn: 1 in a body with a surface. In a smooth region it rises in
/// proportion to n − 1 from 0 in vacuum to 1 at the largest index, theory (7.17), which is held fixed in derivatives.
fn share<T: Real>(grid: &IndexGrid<T>, n: T) -> [T; 2] {
    if grid.level_set().is_some() {
        return [T::one(), T::zero()];
    }
    let contrast = (grid.largest_index() - T::one()).max(T::of(LEAST_CONTRAST));
    [(n - T::one()) / contrast, contrast.recip()]
}

impl<T: Real> Absorption<T> {
    /// That of a path through `medium`.
    pub fn new(medium: &Medium<T>, path: &Path<T>) -> Self {
        let mut new = Self { along: Vec::new() };
        new.follow(medium, path);
        new
    }

    /// Becomes that of another path, theory (7.17).
    pub fn follow(&mut self, medium: &Medium<T>, path: &Path<T>) {
        self.along.clear();
        let mut thickness = [T::zero(); 3];
        for (step, segment) in path.steps.iter().zip(&path.segments) {
            let reach = Reach::of(medium, step, segment.momentum.length());
            let growth =
                reach.map_or([T::zero(); 3], |r| medium.regions()[r.region].absorption().map(|a| a * r.by_t));
            self.along.push([thickness, growth]);
            for c in 0..3 {
                thickness[c] += growth[c] * step.drift;
            }
        }
        self.along.push([thickness, [T::zero(); 3]]);
    }

    /// What absorbs light from the point at `t` of a segment of the path.
    ///
    /// # Panics
    /// If the path has no segment of this number.
    #[inline]
    pub fn filter(&self, segment: usize, t: T) -> Filter<T> {
        let [thickness, growth] = self.along[segment];
        Filter::new([0, 1, 2].map(|c| thickness[c] + growth[c] * t))
    }

    /// True if all points of a segment lie behind the same filter.
    #[inline]
    pub fn is_constant(&self, segment: usize) -> bool {
        self.along[segment][1] == [T::zero(); 3]
    }

    /// What absorbs light from the end of a segment; of the path, if it has no such segment.
    #[inline]
    pub fn after(&self, segment: usize) -> Filter<T> {
        let last = self.along.len() - 1;
        Filter::new(self.along[(segment + 1).min(last)][0])
    }

    /// What absorbs light from behind the path.
    pub fn whole(&self) -> Filter<T> {
        self.after(usize::MAX - 1)
    }
}

impl<T: Real> AbsorptionAdjoint<T> {
    /// Zero, for a path of this many segments.
    pub fn clear(&mut self, segments: usize) {
        self.sums.clear();
        self.sums.resize(segments + 1, [[T::zero(); 3]; 2]);
    }

    /// Adds `d` = dLoss/d(thickness at `t` of a segment).
    #[inline]
    pub fn add(&mut self, segment: usize, t: T, d: [T; 3]) {
        let [sum, moment] = &mut self.sums[segment];
        for c in 0..3 {
            sum[c] += d[c];
            moment[c] += d[c] * t;
        }
    }

    /// Adds `d` = dLoss/d(thickness at the end of a segment); of the path, if it has no such segment.
    #[inline]
    pub fn add_after(&mut self, segment: usize, d: [T; 3]) {
        let last = self.sums.len() - 1;
        self.add(segment.saturating_add(1).min(last), T::zero(), d);
    }

    /// Transpose of [`Absorption::follow`], theory (7.20), from the last segment to the first: adds to the adjoints of
    /// `segments`, and calls `add` with a region and dLoss/d(its coefficients).
    ///
    /// Exact for the replayed path with t of the points held fixed; the largest index of smooth regions is held fixed, too.
    ///
    /// # Panics
    /// Unless there is one adjoint per segment.
    pub fn vjp(
        &self,
        medium: &Medium<T>,
        path: &Path<T>,
        segments: &mut [SegmentAdjoint<T>],
        mut add: impl FnMut(usize, [T; 3]),
    ) {
        assert_eq!(segments.len(), path.segments.len(), "one adjoint per segment");
        let mut behind = self.sums[segments.len()][0];
        for (k, d_segment) in segments.iter_mut().enumerate().rev() {
            let (step, [sum, moment]) = (&path.steps[k], self.sums[k]);
            let momentum = path.segments[k].momentum;
            let speed = momentum.length();
            if let Some(reach) = Reach::of(medium, step, speed) {
                let absorption = medium.regions()[reach.region].absorption();
                // forward: thickness = before + α |p| g t at the points, and with t = τ behind
                let d_growth = [0, 1, 2].map(|c| behind[c] * step.drift + moment[c]);
                add(reach.region, d_growth.map(|d| d * reach.by_t));
                let [mut d_length, mut d_end] = [T::zero(); 2];
                for c in 0..3 {
                    d_length += d_growth[c] * absorption[c];
                    d_end += behind[c] * absorption[c];
                }
                d_segment.momentum += momentum * (d_length * reach.by_speed / speed);
                d_segment.end += d_end * reach.by_t;
            }
            for c in 0..3 {
                behind[c] += sum[c];
            }
        }
    }
}
