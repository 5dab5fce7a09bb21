//! Where a straight line first crosses the zero level of a level set, theory (2.24).
//!
//! Only cells that may hold the zero level are searched; the others are hopped over by their clearance. In a searched cell
//! φ and its slope along the line are sampled twice per voxel. The zero lies between two samples where φ changes its sign,
//! or where φ falls at the first sample and rises at the second and the lowest point of the cubic between them is beyond
//! zero: that finds thin plates and grazing rays. Newton's method within the bracket does the rest. A body of flat faces is met where
//! the line enters the last of its half spaces, and left where it leaves the first; of a spline that planes cut, the same holds, with the
//! spline as one more.

use super::step::State;
use crate::index::NUDGE;
use crate::{LevelSet, Real, Vec3};

/// Longest distance between two samples of φ in cells that may hold its zero level [voxel, along the fastest axis].
/// A dip to zero and back between them is found from the slopes at both ends. At most
/// 0.2 % of lines miss their first crossing, also where coefficients have a noise of four voxels.
pub const SPACING: f64 = 0.5;

/// Bound on the steps of the root search; bisection alone needs fewer to resolve a voxel.
pub const MOST_STEPS: usize = 64;

/// The side of the surface on which a ray travels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Inside,
    Outside,
}

/// φ along x + t p, counted positive on the side of the ray.
struct Line<'a, T: Copy> {
    level: &'a LevelSet<T>,
    /// +1 outside, −1 inside.
    sign: T,
    /// Node coordinates at t = 0.
    start: Vec3<T>,
    /// d(node coordinates)/dt.
    velocity: Vec3<T>,
}

/// φ at one point of a [`Line`].
#[derive(Clone, Copy)]
struct Sample<T> {
    t: T,
    /// ±φ [scene unit].
    u: T,
    /// du/dt.
    slope: T,
}

/// The first t in `[from, end]` at which the line x + t p leaves its `side`; `None` if it stays.
///
/// A ray that stands on the surface, where the last event put it, and moves into its side has not left it, whatever the
/// sign of the rounded φ says there. Error of t: a few units of rounding where the crossing is not grazing.
pub(super) fn first_crossing<T: Real>(
    level: &LevelSet<T>,
    s: &State<T>,
    [from, end]: [T; 2],
    side: Side,
) -> Option<T> {
    let (lattice, sign) = (level.lattice(), if side == Side::Inside { -T::one() } else { T::one() });
    let velocity = s.p.hadamard(lattice.scale);
    let line = Line { level, sign, start: lattice.node(s.x), velocity };
    match level.below_planes(line.start, velocity) {
        None => line.crossing_of_spline(s, [from, end]),
        Some(below) => line.crossing_below_planes(s, below, [from, end], side),
    }
}

impl<T: Real> Line<'_, T> {
    /// Node coordinates at t.
    #[inline(always)]
    fn node(&self, t: T) -> Vec3<T> {
        self.start + self.velocity * t
    }
    /// ±φ of the spline and its slope at t.
    #[inline(always)]
    fn sample(&self, t: T) -> Sample<T> {
        self.counted(t, self.level.sample_spline_at(self.node(t)))
    }
    #[inline(always)]
    fn counted(&self, t: T, (phi, gradient): (T, Vec3<T>)) -> Sample<T> {
        Sample { t, u: self.sign * phi, slope: self.sign * gradient.dot(self.velocity) }
    }
    /// What stands on the surface at t, or by rounding beyond it, and goes on beyond has crossed it.
    fn goes_beyond(&self, t: T) -> bool {
        let start = self.counted(t, self.level.sample_at(self.node(t)));
        start.u <= T::zero() && start.slope < T::zero()
    }

    /// The first crossing of the spline.
    fn crossing_of_spline(&self, s: &State<T>, [from, end]: [T; 2]) -> Option<T> {
        let lattice = self.level.lattice();
        let per_voxel = self.velocity.map(T::abs).max_element().recip();
        let (spacing, nudge) = (T::of(SPACING) * per_voxel, T::of(NUDGE) * per_voxel);
        let mut t = from;
        loop {
            let marked = lattice.first_marked(s.x, s.p, [t, end])?;
            // A hop ends a little inside the cell: begin a little before it.
            let mut a = self.sample(if marked > t { t.max(marked - nudge - nudge) } else { t });
            loop {
                let b = self.sample((a.t + spacing).min(end));
                if let Some(t) = self.crossing_between(a, b) {
                    return Some(t);
                }
                if b.t >= end {
                    return None;
                }
                a = b;
                if lattice.clearance_at(self.node(b.t)) != Some(0) {
                    break;
                }
            }
            t = a.t;
        }
    }

    /// The first crossing of a body that planes enclose, or whose spline they cut: the line is below all of them between `first` and
    /// `last`.
    fn crossing_below_planes(
        &self,
        s: &State<T>,
        [first, last]: [T; 2],
        [from, end]: [T; 2],
        side: Side,
    ) -> Option<T> {
        let has_spline = !self.level.is_of_planes();
        let spline = |range| if has_spline { self.crossing_of_spline(s, range) } else { None };
        let nudge = T::of(NUDGE) * self.velocity.map(T::abs).max_element().recip();
        match side {
            _ if self.goes_beyond(from) => Some(from),
            Side::Inside => {
                let leaves = if first < last { last.max(from) } else { from };
                spline([from, leaves.min(end)]).or_else(|| Some(leaves).filter(|t| *t <= end))
            }
            Side::Outside if first >= last || first > end => None,
            // Nothing comes back below a plane that it has left, or is about to leave.
            Side::Outside if has_spline && last <= from + nudge => None,
            Side::Outside if first >= from && (!has_spline || self.sample(first).u <= T::zero()) => {
                Some(first)
            }
            Side::Outside => spline([first.max(from), last.min(end)]),
        }
    }

    /// The t between two neighbouring samples at which the line leaves its side.
    fn crossing_between(&self, a: Sample<T>, b: Sample<T>) -> Option<T> {
        let zero = T::zero();
        if a.u <= zero && a.slope <= zero {
            return Some(a.t);
        }
        // A ray that left the surface crosses it where u comes back to the value at which it began.
        let base = a.u.min(zero);
        if b.u <= base {
            return Some(self.root(a, b, base));
        }
        if a.slope < zero && b.slope > zero {
            let lowest = self.sample(lowest_between(a, b));
            return (lowest.u <= base).then(|| self.root(a, lowest, base));
        }
        None
    }

    /// Where u falls to `base` between a, where it is higher or rises from it, and b: Newton's method within a bracket,
    /// bisection where a Newton step would leave it.
    fn root(&self, a: Sample<T>, b: Sample<T>, base: T) -> T {
        let [mut low, mut high] = [a, b];
        let half = T::of(0.5);
        // From a, where u may equal `base`, to a point above it.
        for _ in 0..MOST_STEPS {
            if low.u > base {
                break;
            }
            let middle = self.sample(a.t + (high.t - a.t) * half);
            *(if middle.u > base { &mut low } else { &mut high }) = middle;
        }
        let tolerance = self.tolerance(b.t);
        let mut t = low.t + (high.t - low.t) * ((low.u - base) / (low.u - high.u)).min(T::one());
        for _ in 0..MOST_STEPS {
            let m = self.sample(t);
            *(if m.u > base { &mut low } else { &mut high }) = m;
            let newton = t - (m.u - base) / m.slope;
            let is_bracketed = newton >= low.t && newton <= high.t;
            let next = if is_bracketed { newton } else { low.t + (high.t - low.t) * half };
            if (next - t).abs() <= tolerance || high.t - low.t <= tolerance {
                return next;
            }
            t = next;
        }
        t
    }

    /// Rounding of t near `t`: that of t itself and that of node coordinates.
    fn tolerance(&self, t: T) -> T {
        let across = T::of(f64::from(self.level.domain().resolution.into_iter().max().unwrap_or(0)));
        let fastest = self.velocity.map(T::abs).max_element();
        T::epsilon() * (t + across / fastest)
    }
}

/// Where the cubic through values and slopes at both ends, falling at a and rising at b, is lowest.
fn lowest_between<T: Real>(a: Sample<T>, b: Sample<T>) -> T {
    let (length, two, three) = (b.t - a.t, T::of(2.0), T::of(3.0));
    let (d0, d1, rise) = (a.slope * length, b.slope * length, b.u - a.u);
    let (quadratic, cubic) = (three * rise - two * d0 - d1, d0 + d1 - two * rise);
    // The derivative d0 + 2 q s + 3 c s² has one root between 0 and 1, the larger one.
    let s = -d0 / (quadratic + (quadratic * quadratic - three * cubic * d0).max(T::zero()).sqrt());
    a.t + length * s.max(T::zero()).min(T::one())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::tests::Sequence;
    use crate::{Aabb, Ray, vec3};

    /// Share of lines whose first crossing is missed: 60 samples per voxel find an earlier one.
    fn missed(noise: f64, cuts: &[(Vec3<f64>, f64)], side: Side) -> f64 {
        let cube = Aabb::cube(1.0);
        let (mut r, n) = (Sequence(5), 32_usize);
        let voxel = 2.0 / 31.0;
        let c = |j: usize, r: &mut Sequence| {
            let x = Vec3::from([j % n, j / n % n, j / n / n].map(|i| i as f64 * voxel - 1.0));
            x.length() - 0.6 + noise * voxel * r.next()
        };
        let coefficients = (0..n * n * n).map(|j| c(j, &mut r)).collect();
        let level = LevelSet::from_coefficients(cube, [32; 3], coefficients).unwrap();
        let level = level.cut_by(cuts.iter().copied());
        let (mut wrong, mut met) = (0, 0);
        for _ in 0..1000 {
            let d = r.vector().normalized();
            let s = State { x: r.vector() * 0.7 - d * 2.0, p: d };
            let Some([a, b]) = cube.clip(&Ray { origin: s.x, direction: d }) else { continue };
            let is_inside = |t: f64| level.is_inside(s.x + d * t);
            let a = if side == Side::Outside { a } else { 2.0 };
            if is_inside(a) == (side == Side::Outside) {
                continue;
            }
            let found = first_crossing(&level, &s, [a, b], side);
            let steps = ((b - a) / voxel * 60.0) as usize;
            let exact = (0..steps)
                .map(|i| a + (b - a) * i as f64 / steps as f64)
                .find(|t| is_inside(*t) == (side == Side::Outside));
            met += usize::from(exact.is_some());
            let late = exact.is_some_and(|u| found.is_none_or(|t| t > u + 0.02 * voxel));
            wrong += usize::from(late);
            assert!(found.is_none_or(|t| level.value(s.x + d * t).abs() < 1e-12), "a crossing is one");
        }
        wrong as f64 / met as f64
    }

    #[test]
    fn first_crossings_are_those_of_a_dense_search() {
        // Noise of the coefficients [voxel]: smooth, rough, and rougher than any surface.
        for (noise, share) in [(0.0, 0.0), (1.0, 2e-3), (4.0, 2e-3)] {
            let found = missed(noise, &[], Side::Outside);
            assert!(found <= share, "noise of {noise} voxels: {found}");
        }
    }

    #[test]
    fn first_crossings_of_what_planes_cut_are_those_of_a_dense_search() {
        let cuts = [(vec3(0.36, -0.48, 0.8), 0.2), (vec3(-0.3, 0.1, -0.9).normalized(), 0.35)];
        for side in [Side::Outside, Side::Inside] {
            for (noise, share) in [(0.0, 0.0), (1.0, 2e-3)] {
                let found = missed(noise, &cuts, side);
                assert!(found <= share, "{side:?}, noise of {noise} voxels: {found}");
            }
        }
    }
}
