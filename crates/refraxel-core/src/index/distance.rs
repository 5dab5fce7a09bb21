//! Redistancing: a level set becomes the signed distance from its own surface.
//!
//! Steps of an optimiser change φ near the surface only, and its slope drifts away from 1. Near the surface each node gets
//! its distance to the nearest point of the zero level; the fast marching method carries these outwards.

use super::LevelSet;
use crate::{Real, Vec3};
use std::collections::BinaryHeap;

impl<T: Real> LevelSet<T> {
    /// Makes φ the signed distance from its own surface again [scene unit].
    ///
    /// Error: exact up to four voxels away, O(h) beyond. The surface stays where it is to a hundredth of a voxel where its
    /// radii of curvature exceed a few voxels; creases move by about a tenth, as far as a spline of distances can hold
    /// them. Costs about 0.6 µs per node. Does nothing without a surface.
    pub fn redistance(&mut self) {
        let n = self.lattice().nodes();
        let signs: Vec<bool> =
            (0..self.coefficients().len()).map(|j| self.is_inside(self.position(j))).collect();
        let mut distance = spread(near_surface(self), n, self.lattice().scale.map(T::recip));
        if distance.iter().any(|d| d.is_finite()) {
            distance.iter_mut().zip(signs).filter(|(_, inside)| *inside).for_each(|(d, _)| *d = -*d);
            *self = Self::through(self.lattice().clone(), distance);
        }
    }

    /// The body whose surface lies `by` [scene unit] further out, or further in where `by` < 0: φ is made a signed distance,
    /// `by` is subtracted, and φ is made the signed distance from its new surface.
    ///
    /// Convex edges that move outwards and concave ones that move inwards become round with the radius |`by`|. A body
    /// thinner than −2 `by` vanishes, and no surface is left; one that grows into the border of the grid is cut off there.
    /// Error: a hundredth of a voxel for every three voxels of `by`, where the radii of curvature of both surfaces exceed a
    /// few voxels. Costs about 1.2 µs per node, and half as much again for every further three voxels.
    #[must_use]
    pub fn offset(&self, by: T) -> Self {
        let mut body = self.clone();
        body.redistance();
        // Distances are exact up to four voxels from the surface.
        let steps = (by.abs() / (T::of(3.0) * self.voxel())).f64().ceil().max(1.0);
        for _ in 0..steps as u64 {
            // B-splines add up to 1: a constant is subtracted from φ by subtracting it from each coefficient.
            body.coefficients_mut().iter_mut().for_each(|c| *c -= by / T::of(steps));
            body.find_surface();
            body.redistance();
        }
        body
    }
}

/// Nodes up to this many cells from the surface get their exact distance [cell]. Further out the error of the march is a
/// few percent of a voxel, of which interpolation passes on a factor of 0.27 per node towards the surface.
const NEAR: u8 = 4;

/// Distance to the zero level [scene unit] of the nodes up to [`NEAR`] cells from it, infinite elsewhere.
fn near_surface<T: Real>(level: &LevelSet<T>) -> Vec<T> {
    (0..level.coefficients().len())
        .map(|j| {
            let x = level.position(j);
            if level.clearance(x).is_none_or(|c| c > NEAR) {
                return T::infinity();
            }
            to_surface(level, x)
        })
        .collect()
}

/// Distance from `x` to the nearest point of the zero level [scene unit], the foot of the perpendicular: each step moves
/// onto the surface, by Newton's method, and along it. |φ|/|∇φ| where the steps do not settle to 1e-4 voxel, as at a
/// crease; infinite where that is too far for a node beside the surface.
fn to_surface<T: Real>(level: &LevelSet<T>, x: Vec3<T>) -> T {
    const MOST_STEPS: usize = 20;
    let (voxel, mut foot) = (level.voxel(), x);
    let (close, farthest) = (T::of(1e-4) * voxel, T::of(2.0 * f64::from(NEAR)) * voxel);
    let (phi, gradient) = level.sample(x);
    for _ in 0..MOST_STEPS {
        let (phi, gradient) = level.sample(foot);
        let square = gradient.dot(gradient);
        let onto = gradient * (phi / square);
        let away = x - foot;
        let along = away - gradient * (away.dot(gradient) / square);
        if onto.length() < close && along.length() < T::of(10.0) * close {
            return (x - foot).length();
        }
        foot = foot - onto + along * T::of(0.7);
        if !foot.is_finite() || (foot - x).length() > farthest {
            break;
        }
    }
    let estimate = phi.abs() / gradient.length();
    if estimate < farthest { estimate } else { T::infinity() }
}

/// All distances [scene unit] from the known ones, which are finite and stay, by the first-order fast marching method for
/// `n` nodes, x fastest, with edge lengths `h` [scene unit]. Source: Sethian 1996.
fn spread<T: Real>(mut distance: Vec<T>, n: [usize; 3], h: Vec3<T>) -> Vec<T> {
    let strides = [1, n[0], n[0] * n[1]];
    let neighbours = |j: usize, axis: usize| {
        let i = j / strides[axis] % n[axis];
        [(i > 0).then(|| j - strides[axis]), (i + 1 < n[axis]).then(|| j + strides[axis])]
    };
    let given: Vec<bool> = distance.iter().map(|d| d.is_finite()).collect();
    let mut done = vec![false; distance.len()];
    let mut front: BinaryHeap<Near> = (0..distance.len())
        .filter(|&j| given[j])
        .map(|j| Near { distance: distance[j].f64(), node: j })
        .collect();
    while let Some(Near { node: j, .. }) = front.pop() {
        if std::mem::replace(&mut done[j], true) {
            continue;
        }
        for axis in 0..3 {
            for k in neighbours(j, axis).into_iter().flatten().filter(|&k| !done[k] && !given[k]) {
                let upwind = [0, 1, 2].map(|a| {
                    let least = neighbours(k, a)
                        .into_iter()
                        .flatten()
                        .filter(|&m| done[m] || given[m])
                        .map(|m| distance[m]);
                    Upwind { distance: least.fold(T::infinity(), T::min), edge: h[a] }
                });
                let arrival = eikonal(upwind);
                if arrival < distance[k] {
                    distance[k] = arrival;
                    front.push(Near { distance: arrival.f64(), node: k });
                }
            }
        }
    }
    distance
}

/// A node of the front, ordered so that the nearest is the greatest: a binary heap returns it first.
#[derive(PartialEq)]
struct Near {
    distance: f64,
    node: usize,
}

impl Eq for Near {}
impl Ord for Near {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.distance.total_cmp(&self.distance).then(other.node.cmp(&self.node))
    }
}
impl PartialOrd for Near {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// The nearer neighbour of a node along one axis: where its distance comes from.
#[derive(Clone, Copy)]
struct Upwind<T> {
    /// Distance of the neighbour dₐ [scene unit]; infinite if it is not known yet.
    distance: T,
    /// Edge length of a voxel along the axis hₐ [scene unit].
    edge: T,
}

/// The d with Σ ((d − dₐ)/hₐ)² = 1 over the axes with dₐ < d: |∇d| = 1 in differences of first order.
fn eikonal<T: Real>(mut upwind: [Upwind<T>; 3]) -> T {
    upwind.sort_by(|a, b| a.distance.f64().total_cmp(&b.distance.f64()));
    let mut d = upwind[0].distance + upwind[0].edge;
    // a d² − 2 b d + c = 0
    let (mut a, mut b, mut c) = (T::zero(), T::zero(), -T::one());
    for (axis, &Upwind { distance: at, edge: h }) in upwind.iter().enumerate() {
        if axis > 0 && d <= at {
            break;
        }
        let weight = (h * h).recip();
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

    fn cube<T: Real>() -> Aabb<T> {
        Aabb::new(Vec3::splat(-T::one()), Vec3::splat(T::one()))
    }

    #[test]
    fn redistancing_keeps_the_surface_and_makes_the_gradient_one() {
        // An ellipsoid by its quadratic form, whose gradient on the surface varies between 0.67 and 1.25.
        let form = |x: Vec3<f64>| {
            let y = vec3(x.x / 0.75, x.y / 0.5, x.z / 0.4);
            0.25 * (y.dot(y) - 1.0)
        };
        let level = LevelSet::from_samples(cube(), [48, 50, 46], form);
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
            let level = LevelSet::from_samples(cube::<T>(), [40; 3], |x| x.length() - T::of(0.6));
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
        let level = LevelSet::from_samples(cube(), [48; 3], |x: Vec3<f64>| {
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
    fn the_offset_of_a_ball_is_the_ball_of_the_other_radius() {
        let ball = LevelSet::from_samples(cube(), [48; 3], |x: Vec3<f64>| x.length() - 0.5);
        let mut r = Sequence(6);
        for voxels in [-5.0, -1.5, 0.0, 0.4, 2.0, 4.0] {
            let by = voxels * ball.voxel();
            let (moved, far) = (ball.offset(by), vec3(0.1, 0.05, 0.0));
            for _ in 0..100 {
                let off = moved.value(r.vector().normalized() * (0.5 + by)) / ball.voxel();
                assert!(off.abs() < 0.02, "moved by {voxels} voxels: {off} voxels beside");
            }
            assert!((moved.value(far) - (far.length() - 0.5 - by)).abs() < 0.5 * ball.voxel());
        }
    }

    #[test]
    fn a_body_thinner_than_twice_the_offset_vanishes() {
        let ball = LevelSet::from_samples(cube(), [32; 3], |x: Vec3<f64>| x.length() - 0.3);
        let gone = ball.offset(-0.35);
        assert!(gone.coefficients().iter().all(|c| *c > 0.0));
    }

    #[test]
    fn without_a_surface_nothing_happens() {
        let mut level = LevelSet::from_samples(cube(), [12; 3], |_| 0.3_f64);
        let before = level.coefficients().to_vec();
        level.redistance();
        assert_eq!(level.coefficients(), before);
    }
}
