//! Redistancing: a level set becomes the signed distance from its own surface.
//!
//! Steps of an optimiser change φ near the surface only, and its slope drifts away from 1. Near the surface each node gets
//! its distance to the nearest point of the zero level; the fast marching method carries these outwards.

use super::LevelSet;
use crate::{Real, Vec3};

impl<T: Real> LevelSet<T> {
    /// Makes φ the signed distance from its own surface again [scene unit].
    ///
    /// Error: exact up to four voxels away, O(h) beyond and half-way between two sides. The surface stays where it is to a hundredth of a voxel where its
    /// radii of curvature exceed a few voxels; creases move by about a tenth, as far as a spline of distances can hold
    /// them. Costs about 0.6 µs per node. Does nothing without a surface.
    pub fn redistance(&mut self) {
        let cuts = self.take_cuts();
        let n = self.lattice().nodes();
        let (distance, is_inside) = near_surface(self);
        let mut distance = spread(distance, n, self.lattice().scale.map(T::recip));
        if distance.iter().any(|d| d.is_finite()) {
            distance.iter_mut().zip(is_inside).filter(|(_, inside)| *inside).for_each(|(d, _)| *d = -*d);
            *self = Self::through(self.lattice().clone(), distance);
        }
        self.put_cuts(cuts);
    }
}

/// Nodes up to this many cells from the surface get their exact distance [cell]. Further out the error of the march is a
/// few percent of a voxel, of which interpolation passes on a factor of 0.27 per node towards the surface.
const NEAR: u8 = 4;

/// Distance to the zero level [scene unit] of the nodes up to [`NEAR`] cells from it, infinite elsewhere; and whether nodes are
/// inside. Far from the surface a node is on the side of its coefficient.
fn near_surface<T: Real>(level: &LevelSet<T>) -> (Vec<T>, Vec<bool>) {
    let coefficients = level.coefficients().iter().enumerate();
    let of = |(j, c): (usize, &T)| {
        let x = level.position(j);
        if level.clearance(x).is_some_and(|c| c > NEAR) {
            return (T::infinity(), *c < T::zero());
        }
        let at = level.sample(x);
        // A cell that holds the surface is no further away; a perpendicular that is longer belongs to another side.
        let diagonal = T::of(3.0_f64.sqrt()) * level.voxel();
        let farthest = level.clearance(x).map(|cells| diagonal * T::of(f64::from(cells) + 1.0));
        let found = farthest.map(|farthest| to_surface(level, x, at, farthest));
        (found.unwrap_or(T::infinity()), at.0 < T::zero())
    };
    coefficients.map(of).unzip()
}

/// Distance from `x` to the nearest point of the zero level [scene unit], the foot of the perpendicular; `at` is (φ, ∇φ) at `x`. Each step moves
/// onto the surface, by Newton's method, and along it. Infinite where the steps do not settle to 1e-4 voxel, as at a crease or
/// half-way between two sides, and where the foot is farther away than `farthest`.
fn to_surface<T: Real>(level: &LevelSet<T>, x: Vec3<T>, at: (T, Vec3<T>), farthest: T) -> T {
    const MOST_STEPS: usize = 20;
    let (mut foot, mut there) = (x, at);
    let close = T::of(1e-4) * level.voxel();
    for _ in 0..MOST_STEPS {
        let (phi, gradient) = there;
        let square = gradient.dot(gradient);
        let onto = gradient * (phi / square);
        let away = x - foot;
        let along = away - gradient * (away.dot(gradient) / square);
        if onto.length() < close && along.length() < T::of(10.0) * close {
            return if away.length() <= farthest { away.length() } else { T::infinity() };
        }
        foot = foot - onto + along * T::of(0.7);
        if !foot.is_finite() || (foot - x).length() > T::of(2.0) * farthest {
            break;
        }
        there = level.sample(foot);
    }
    T::infinity()
}

/// All distances [scene unit] from the known ones, which are finite and stay, for `n` nodes, x fastest, with edge lengths `h`
/// [scene unit]: the solution of the upwind differences of first order. Nodes wait in buckets of half a voxel, nearest bucket
/// first; one that turns out nearer waits again, so that the order within a bucket does not matter. Sources: Sethian 1996 for
/// the differences, Yatziv et al. 2006 for the buckets.
fn spread<T: Real>(mut distance: Vec<T>, n: [usize; 3], h: Vec3<T>) -> Vec<T> {
    let given: Vec<bool> = distance.iter().map(|d| d.is_finite()).collect();
    let (strides, edges) = ([1, n[0], n[0] * n[1]], [h.x, h.y, h.z]);
    let weights = edges.map(|h| (h * h).recip());
    let per_bucket = T::of(2.0) * weights.into_iter().fold(T::zero(), T::max).sqrt();
    let mut waiting: Vec<Vec<u32>> = Vec::new();
    let wait = |waiting: &mut Vec<Vec<u32>>, j: usize, d: T| {
        let bucket = (d * per_bucket).f64() as usize;
        if bucket >= waiting.len() {
            waiting.resize_with(bucket + 1, Vec::new);
        }
        waiting[bucket].push(j as u32);
    };
    (0..distance.len()).filter(|&j| given[j]).for_each(|j| wait(&mut waiting, j, distance[j]));
    let mut nearest = 0;
    while nearest < waiting.len() {
        let Some(j) = waiting[nearest].pop().map(|j| j as usize) else {
            nearest += 1;
            continue;
        };
        if ((distance[j] * per_bucket).f64() as usize) < nearest {
            continue; // it turned out nearer
        }
        let at = [j % n[0], j / n[0] % n[1], j / strides[2]];
        let step = |at: [usize; 3], j: usize, axis: usize| {
            let before = (at[axis] > 0).then(|| j - strides[axis]);
            [before, (at[axis] + 1 < n[axis]).then(|| j + strides[axis])]
        };
        for axis in 0..3 {
            for (side, k) in step(at, j, axis).into_iter().enumerate() {
                let Some(k) = k.filter(|&k| !given[k] && distance[k] > distance[j]) else { continue };
                let mut to = at;
                to[axis] = if side == 0 { at[axis] - 1 } else { at[axis] + 1 };
                let upwind = [0, 1, 2].map(|a| {
                    let least = step(to, k, a).into_iter().flatten().map(|m| distance[m]);
                    Upwind { distance: least.fold(T::infinity(), T::min), weight: weights[a] }
                });
                let arrival = eikonal(upwind);
                if arrival < distance[k] {
                    distance[k] = arrival;
                    wait(&mut waiting, k, arrival);
                }
            }
        }
    }
    distance
}

/// The nearer neighbour of a node along one axis: where its distance comes from.
#[derive(Clone, Copy)]
struct Upwind<T> {
    /// Distance of the neighbour dₐ [scene unit]; infinite if it is not known yet.
    distance: T,
    /// 1/hₐ², hₐ being the edge of a voxel along the axis [1 / scene unit²].
    weight: T,
}

/// The d with Σ ((d − dₐ)/hₐ)² = 1 over the axes with dₐ < d: |∇d| = 1 in differences of first order.
fn eikonal<T: Real>(mut upwind: [Upwind<T>; 3]) -> T {
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        if upwind[b].distance < upwind[a].distance {
            upwind.swap(a, b);
        }
    }
    // a d² − 2 b d + c = 0
    let (mut a, mut b, mut c, mut d) = (T::zero(), T::zero(), -T::one(), T::infinity());
    for Upwind { distance: at, weight } in upwind {
        if d <= at || !at.is_finite() {
            break;
        }
        a += weight;
        b += weight * at;
        c += weight * at * at;
        d = (b + (b * b - a * c).max(T::zero()).sqrt()) / a;
    }
    d
}

#[cfg(test)]
mod tests {
    use crate::index::tests::Sequence;
    use crate::{Aabb, LevelSet, Real, Vec3, vec3};

    #[test]
    fn redistancing_keeps_the_surface_and_makes_the_gradient_one() {
        // An ellipsoid by its quadratic form, whose gradient on the surface varies between 0.67 and 1.25.
        let form = |x: Vec3<f64>| {
            let y = vec3(x.x / 0.75, x.y / 0.5, x.z / 0.4);
            0.25 * (y.dot(y) - 1.0)
        };
        let level = LevelSet::from_samples(Aabb::cube(1.0), [48, 50, 46], form);
        let mut distance = level.clone();
        distance.redistance();
        let (mut r, mut moved, mut off) = (Sequence(4), 0.0_f64, 0.0_f64);
        for _ in 0..500 {
            let d = r.vector().normalized();
            let y = vec3(d.x / 0.75, d.y / 0.5, d.z / 0.4);
            let x = d / y.length();
            let (phi, gradient) = distance.sample(x);
            moved = moved.max(phi.abs() / distance.voxel());
            off = off.max((gradient.length() - 1.0).abs());
            // Exact on both sides of the surface, of first order further away.
            let outward = gradient.normalized();
            for voxels in [-1.5, 1.0, 2.0] {
                let there = distance.value(x + outward * (voxels * distance.voxel())) / distance.voxel();
                assert!((there - voxels).abs() < 0.05, "{voxels} voxels: {there}");
            }
        }
        assert!(moved < 0.01 && off < 0.02, "moved by {moved} voxels, slope off by {off}");
        assert!((distance.value(Vec3::splat(0.8)) - 0.84).abs() < 0.05);
    }

    #[test]
    fn redistancing_a_distance_changes_nothing_near_its_surface_in_either_precision() {
        fn change<T: Real>() -> f64 {
            let level = LevelSet::from_samples(Aabb::cube(T::one()), [40; 3], |x| x.length() - T::of(0.6));
            let mut again = level.clone();
            (0..5).for_each(|_| again.redistance());
            let mut r = Sequence(8);
            let off = (0..500).map(|_| {
                let x = (r.vector().normalized() * 0.6).cast::<T>();
                ((again.value(x) - level.value(x)) / level.voxel()).abs().f64()
            });
            off.fold(0.0, f64::max)
        }
        let (double, single) = (change::<f64>(), change::<f32>());
        assert!(double < 0.01 && single < 0.01, "{double}, {single} voxels after five times");
    }

    #[test]
    fn edges_move_by_a_fraction_of_a_voxel() {
        let level = LevelSet::from_samples(Aabb::cube(1.0), [48; 3], |x: Vec3<f64>| {
            x.x.abs().max(x.y.abs()).max(x.z.abs()) - 0.5
        });
        let mut distance = level.clone();
        distance.redistance();
        let (voxel, mut r) = (level.voxel(), Sequence(2));
        for _ in 0..300 {
            let (a, b) = (0.49 * r.next(), 0.49 * r.next());
            let at = |level: &LevelSet<f64>| level.value(vec3(a, 0.5, b)) / voxel;
            let flat = a.abs().max(b.abs()) < 0.5 - 4.0 * voxel;
            let moved = (at(&distance) - at(&level)).abs();
            assert!(moved < if flat { 0.01 } else { 0.2 }, "{moved} voxels at {a}, {b}");
        }
    }

    #[test]
    fn distances_have_no_outliers_between_two_sides() {
        // Two balls that nearly touch, alone and joined by a bar. φ is the least of three distances: exact outside, and inside
        // the surface is no nearer, and no deeper than a ball.
        let ball = |x: Vec3<f64>, at: f64| (x - vec3(at, 0.0, 0.0)).length() - 0.4;
        for bar in [-1.0, 0.06, 0.2] {
            let along = |x: Vec3<f64>| (vec3(0.0, x.y, x.z).length() - bar).max(x.x.abs() - 0.4);
            let of = |x: Vec3<f64>| ball(x, -0.42).min(ball(x, 0.42)).min(along(x));
            let mut distance = LevelSet::from_samples(Aabb::cube(1.0), [61; 3], of);
            distance.redistance();
            let off = |j: usize| {
                let x = distance.position(j);
                let (found, nearest) = (distance.value(x), of(x));
                if nearest > 0.0 { (found - nearest).abs() } else { (found - nearest).max(-0.4 - found) }
            };
            let is_near = |j: &usize| distance.position(*j).to_array().iter().all(|c| c.abs() < 0.9);
            let worst = (0..61 * 61 * 61).filter(is_near).map(off).fold(0.0, f64::max) / distance.voxel();
            assert!(worst < 2.0, "a bar of {bar}: {worst} voxels off");
        }
    }

    #[test]
    fn without_a_surface_nothing_happens() {
        let mut level = LevelSet::from_samples(Aabb::cube(1.0), [12; 3], |_| 0.3_f64);
        let before = level.coefficients().to_vec();
        level.redistance();
        assert_eq!(level.coefficients(), before);
    }
}
