//! Completing a shape: the parts of glass that straight rays nearly explain.
//!
//! Through the bottom of a tank, or a prism, straight rays see the ground as if it were raised, and hardly err; the shape that separates
//! best lacks its bottom, and has holes. Glass is mostly convex, and much of it stands on something. So the convex hull of each part
//! is tried, and then the hull with its shadow on the ground. Either is taken if the cells that it adds are explained worse than the
//! cells beside them: a contrast of neighbours, which is found far below the differences between one end of a scene and the other.

use super::evidence::Evidence;
use crate::model::Gate;
use crate::model::polyhedron::Plane;
use crate::refraction_search::{NONE, connected};
use rayon::prelude::*;
use refraxel_core::{Vec3, vec3};

/// Directions in which a hull is bounded.
const DIRECTIONS: usize = 256;
/// Share of the nodes of a part that lie beyond no bound: a tip of few nodes widens no hull.
const WITHIN: f32 = 0.998;
/// The mean residual of cells that are added must be larger by this factor than that of those beside them.
const CONTRAST: f64 = 1.25;
/// Cells beside what is added with which it is compared [cell]: from here to there.
const BESIDE: [usize; 2] = [2, 5];
/// Cells so near to what was there before do not decide: the blur of residuals reaches them [cell].
const BLURRED: usize = 2;
/// A part stands on the ground that is so near below it [height of the part].
const NEAR: f32 = 0.75;
/// Only what does not narrow towards its bottom goes on below it: its lowest slice has at least this part of the largest one, as that
/// of a box without some of its bottom has. The lowest fifth of a ball has a third.
const UPRIGHT: f32 = 0.5;
/// Slices of a part; each holds some layers of nodes.
const SLICES: usize = 5;

/// The shape with what completes it.
pub(super) fn completed(found: &Gate, ground: Option<&Plane>, views: &[Evidence]) -> Gate {
    let mut gate = found.clone();
    for part in parts(found) {
        let hull = Hull::of(&part);
        gate = larger(gate, &hull, views);
        let filled: Vec<Vec3<f32>> = nodes(&gate).filter(|x| hull.depth(*x) > 0.0).collect();
        let shadow = ground.and_then(|plane| Some(Hull::of(&with_shadow(&filled, plane)?)));
        if let Some(hull) = shadow {
            gate = larger(gate, &hull, views);
        }
    }
    gate
}

/// The places of all nodes.
fn nodes(gate: &Gate) -> impl Iterator<Item = Vec3<f32>> {
    let domain = *gate.domain();
    (0..gate.values().len()).map(move |node| domain.place(node))
}

/// The places of the nodes of each connected part.
fn parts(gate: &Gate) -> Vec<Vec<Vec3<f32>>> {
    let domain = gate.domain();
    let (labels, sizes) = connected(domain.resolution.map(|n| n as usize), |node| gate.values()[node] > 127);
    let mut parts = vec![Vec::new(); sizes.len()];
    for (node, label) in labels.iter().enumerate().filter(|(_, label)| **label != NONE) {
        parts[*label as usize].push(domain.place(node));
    }
    parts
}

/// A part and where it stands; `None` where it does not stand on the ground.
fn with_shadow(part: &[Vec3<f32>], ground: &Plane) -> Option<Vec<Vec3<f32>>> {
    let heights = || part.iter().map(|x| ground.height(*x));
    let (low, high) = (heights().fold(f32::INFINITY, f32::min), heights().fold(f32::NEG_INFINITY, f32::max));
    let stands = low > 0.0 && low <= NEAR * (high - low) && is_upright(heights(), low, high);
    let shadow = part.iter().map(|x| *x - ground.normal() * ground.height(*x));
    stands.then(|| part.iter().copied().chain(shadow).collect())
}

/// Whether the slice at the bottom is nearly as large as any.
fn is_upright(heights: impl Iterator<Item = f32>, low: f32, high: f32) -> bool {
    let mut slices = [0.0_f32; SLICES];
    for height in heights {
        let place = (height - low) / (high - low).max(f32::MIN_POSITIVE);
        slices[((place * SLICES as f32) as usize).min(SLICES - 1)] += 1.0;
    }
    slices[0] >= UPRIGHT * slices.iter().copied().fold(0.0, f32::max)
}

/// A convex hull, as bounds in many directions.
struct Hull {
    bounds: Vec<(Vec3<f32>, f32)>,
}

impl Hull {
    fn of(points: &[Vec3<f32>]) -> Self {
        let bound = |direction: Vec3<f32>| {
            let mut reach: Vec<f32> = points.iter().map(|x| x.dot(direction)).collect();
            let last = ((reach.len() - 1) as f32 * WITHIN) as usize;
            (direction, *reach.select_nth_unstable_by(last, f32::total_cmp).1)
        };
        Self { bounds: (0..DIRECTIONS).into_par_iter().map(|k| bound(direction(k))).collect() }
    }

    /// How far a point lies within it, negative outside.
    fn depth(&self, x: Vec3<f32>) -> f32 {
        self.bounds.iter().map(|(n, reach)| reach - x.dot(*n)).fold(f32::INFINITY, f32::min)
    }
}

/// Directions that are spread evenly: the golden angle about an axis.
fn direction(k: usize) -> Vec3<f32> {
    let z = 1.0 - (2.0 * k as f32 + 1.0) / DIRECTIONS as f32;
    let (r, angle) = ((1.0 - z * z).sqrt(), 2.399_963 * k as f32);
    vec3(r * angle.cos(), r * angle.sin(), z)
}

/// A shape and a hull, if the views say that there is something in what it adds.
fn larger(gate: Gate, hull: &Hull, views: &[Evidence]) -> Gate {
    let domain = *gate.domain();
    let share = |(node, value): (usize, &u8)| {
        let depth = hull.depth(domain.place(node));
        (f32::from(*value) / 255.0).max((0.5 + depth / domain.voxel()).clamp(0.0, 1.0))
    };
    let values: Vec<f32> = gate.values().par_iter().enumerate().map(share).collect();
    let with = Gate::new(domain, &values);
    let sums = views.par_iter().map(|view| contrast(view, &gate, &with));
    let sums: Vec<[[f64; 2]; 2]> = sums.collect(); // in order: the bits of a sum depend on it
    let add = |a: [[f64; 2]; 2], b: &[[f64; 2]; 2]| [0, 1].map(|k| [0, 1].map(|i| a[k][i] + b[k][i]));
    let [added, beside] = sums.iter().fold([[0.0; 2]; 2], add);
    let mean = |[count, sum]: [f64; 2]| sum / count.max(1.0);
    let stands_out = added[0] > 0.0 && beside[0] > 0.0 && mean(added) > CONTRAST * mean(beside);
    if stands_out { with } else { gate }
}

/// Number and sum of the residuals of the cells of a view that a larger shape adds, and of those beside what it adds.
fn contrast(view: &Evidence, before: &Gate, with: &Gate) -> [[f64; 2]; 2] {
    let size = [view.camera.width as usize, view.camera.height as usize];
    let covers = |gate: &Gate| -> Vec<bool> {
        view.rays.iter().map(|ray| ray.is_some_and(|ray| gate.admits(&ray))).collect()
    };
    let (small, large) = (covers(before), covers(with));
    let (blurred, near) = (grown(&small, size, BLURRED), grown(&large, size, BESIDE[0]));
    let added: Vec<bool> = large.iter().zip(&blurred).map(|(l, b)| *l && !b).collect();
    let around = grown(&added, size, BESIDE[1]);
    let mut sums = [[0.0; 2]; 2];
    for cell in (0..small.len()).filter(|cell| view.counts(*cell) && view.shows_something(*cell)) {
        let which = [added[cell], around[cell] && !near[cell]];
        for (sum, _) in sums.iter_mut().zip(which).filter(|(_, is)| *is) {
            sum[0] += 1.0;
            sum[1] += f64::from(view.residual[cell]);
        }
    }
    sums
}

/// True within so many rows and columns of what is.
fn grown(set: &[bool], [width, height]: [usize; 2], by: usize) -> Vec<bool> {
    let along = |set: &[bool], at: usize, place: usize, count: usize, stride: usize| {
        let first = at - place * stride;
        let mut range = place.saturating_sub(by)..(place + by + 1).min(count);
        range.any(|p| set[first + p * stride])
    };
    let rows: Vec<bool> = (0..set.len()).map(|at| along(set, at, at % width, width, 1)).collect();
    (0..set.len()).map(|at| along(&rows, at, at / width, height, width)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::detection::tests::{gate, overlap_of, views_of};

    fn is_block(x: Vec3<f32>) -> bool {
        x.x.abs() < 0.5 && x.y.abs() < 0.4 && (-0.5..0.4).contains(&x.z)
    }

    #[test]
    fn a_block_whose_bottom_and_middle_are_nearly_explained_is_completed() {
        let seen = |x: Vec3<f32>| is_block(x) && x.z > -0.2 && !(x.x.abs() < 0.2 && x.y < 0.0);
        let (found, truth) = (gate(seen), gate(is_block));
        let views = views_of(|ray| {
            if found.admits(ray) {
                0.2
            } else if truth.admits(ray) {
                0.04
            } else {
                0.02
            }
        });
        let ground = Plane::facing(vec3(0.0, 0.0, 1.0), -0.5);
        let with = completed(&found, Some(&ground), &views);
        let [before, after] = [&found, &with].map(|gate| overlap_of(gate, is_block));
        assert!(before < 0.65 && after > 0.9, "{before} {after}");
    }

    #[test]
    fn a_ball_does_not_grow_down_to_the_ground_and_two_balls_stay_two() {
        let is_ball = |x: Vec3<f32>| (x - vec3(0.0, 0.0, 0.1)).length() < 0.4;
        let found = gate(is_ball);
        let views = views_of(|ray| if found.admits(ray) { 0.2 } else { 0.02 });
        let ground = Plane::facing(vec3(0.0, 0.0, 1.0), -0.4);
        let with = completed(&found, Some(&ground), &views);
        assert!(overlap_of(&with, is_ball) > 0.9);
        let is_pair = |x: Vec3<f32>| (vec3(x.x.abs(), x.y, x.z) - vec3(0.5, 0.0, 0.0)).length() < 0.35;
        let found = gate(is_pair);
        let views = views_of(|ray| if found.admits(ray) { 0.2 } else { 0.02 });
        assert!(overlap_of(&completed(&found, None, &views), is_pair) > 0.9);
    }
}
