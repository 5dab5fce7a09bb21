//! The bodies of a hull, each with a surface of its own: its connected parts, and what stricter silhouettes show apart.

use refraxel_core::{Aabb, LevelSet};

/// Parts with fewer nodes than this share of the largest are specks.
const SPECK: f32 = 0.02;
/// So are parts of fewer nodes than this.
const LEAST: usize = 27;

/// What the strictest hull shows apart is a body of its own if it has at least this share of the largest; else it is a foot, a
/// handle or a spout.
const BODY: f32 = 0.2;

/// No part.
pub(crate) const NONE: u32 = u32::MAX;

/// One level set per connected part of a body (nodes inside that touch along an axis), the largest first, all on the grid of
/// the whole. Specks, and parts of which less than half lies in the box where something was found, are none. A body of one
/// part stays as it is.
///
/// `cores` numbers the nodes that surely belong to a body ([`cores`]): a part that holds several of them is several bodies, and
/// its other nodes go with the nearest.
pub(super) fn parts(whole: &LevelSet<f32>, found: &Aabb<f32>, cores: &[u32]) -> Vec<LevelSet<f32>> {
    let n = whole.domain().resolution.map(|n| n as usize);
    let phi = whole.coefficients();
    let (mut labels, mut sizes) = connected(n, |j| phi[j] < 0.0);
    divide(n, cores, &mut labels, &mut sizes);
    let mut within = vec![0; sizes.len()];
    for (j, label) in labels.iter().enumerate().filter(|(_, l)| **l != NONE) {
        within[*label as usize] += usize::from(found.contains(whole.position(j)));
    }
    let largest = within.iter().copied().max().unwrap_or(0) as f32;
    let is_body =
        |k: usize| within[k] >= LEAST && within[k] as f32 >= SPECK * largest && 2 * within[k] >= sizes[k];
    let mut kept: Vec<u32> = (0..sizes.len()).filter(|k| is_body(*k)).map(|k| k as u32).collect();
    if kept.is_empty() || sizes.len() < 2 {
        return vec![whole.clone()];
    }
    kept.sort_by_key(|k| std::cmp::Reverse(sizes[*k as usize]));
    grow(n, &mut labels);
    kept.iter().map(|k| of_label(whole, &labels, *k)).collect()
}

/// Numbers of the bodies that nodes surely belong to, [`NONE`] for others: the large parts of what is surely inside.
///
/// Silhouettes of two bodies near each other overlap in many views, and a hull that forgives a few votes, or closes narrow
/// gaps, grows together between them.
pub(super) fn cores(n: [usize; 3], is_surely_inside: impl Fn(usize) -> bool) -> Vec<u32> {
    let (mut labels, sizes) = connected(n, is_surely_inside);
    let least = BODY * sizes.iter().copied().max().unwrap_or(0) as f32;
    let is_large = |label: u32| sizes[label as usize] >= LEAST && sizes[label as usize] as f32 >= least;
    labels.iter_mut().filter(|l| **l != NONE).for_each(|l| *l = if is_large(*l) { *l } else { NONE });
    labels
}

/// Divides each part that holds several cores among these.
fn divide(n: [usize; 3], cores: &[u32], labels: &mut [u32], sizes: &mut Vec<usize>) {
    for part in 0..sizes.len() as u32 {
        let mut held: Vec<u32> =
            labels.iter().zip(cores).map(|(l, c)| if *l == part { *c } else { NONE }).collect();
        let mut bodies: Vec<u32> = held.iter().copied().filter(|c| *c != NONE).collect();
        bodies.sort_unstable();
        bodies.dedup();
        if bodies.len() < 2 {
            continue;
        }
        grow(n, &mut held);
        // The first body keeps the number.
        for (label, core) in labels.iter_mut().zip(held).filter(|(l, _)| **l == part) {
            let body = bodies.iter().position(|b| *b == core).unwrap_or(0);
            if body > 0 {
                *label = (sizes.len() + body - 1) as u32;
            }
        }
        let first = sizes.len();
        sizes.resize(first + bodies.len() - 1, 0);
        for k in std::iter::once(part as usize).chain(first..sizes.len()) {
            sizes[k] = labels.iter().filter(|l| **l == k as u32).count();
        }
    }
}

/// Per node of a grid the number of the part that it belongs to, [`NONE`] for nodes that are not inside, and per part how many
/// nodes it has. Nodes inside that touch along an axis are one part.
pub(crate) fn connected(n: [usize; 3], inside: impl Fn(usize) -> bool) -> (Vec<u32>, Vec<usize>) {
    let total = n.iter().product();
    let (mut labels, mut sizes) = (vec![NONE; total], Vec::new());
    for seed in 0..total {
        if !inside(seed) || labels[seed] != NONE {
            continue;
        }
        let (label, mut stack, mut count) = (sizes.len() as u32, vec![seed], 0);
        labels[seed] = label;
        while let Some(node) = stack.pop() {
            count += 1;
            for next in neighbours(node, n) {
                if inside(next) && labels[next] == NONE {
                    labels[next] = label;
                    stack.push(next);
                }
            }
        }
        sizes.push(count);
    }
    (labels, sizes)
}

/// Gives every node the label of the nearest labelled one, along axes.
fn grow(n: [usize; 3], labels: &mut [u32]) {
    let mut front: Vec<usize> = (0..labels.len()).filter(|j| labels[*j] != NONE).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for node in front {
            for other in neighbours(node, n) {
                if labels[other] == NONE {
                    labels[other] = labels[node];
                    next.push(other);
                }
            }
        }
        front = next;
    }
}

/// The nodes beside a node along the axes, of a grid of so many.
pub(crate) fn neighbours(node: usize, n: [usize; 3]) -> impl Iterator<Item = usize> {
    let at = [node % n[0], node / n[0] % n[1], node / (n[0] * n[1])];
    let stride = [1, n[0], n[0] * n[1]];
    (0..3).flat_map(move |a| {
        let before = (at[a] > 0).then(|| node - stride[a]);
        let after = (at[a] + 1 < n[a]).then(|| node + stride[a]);
        [before, after].into_iter().flatten()
    })
}

/// The part of one label: everything nearer to another part is outside.
fn of_label(whole: &LevelSet<f32>, labels: &[u32], label: u32) -> LevelSet<f32> {
    let voxel = whole.voxel();
    let own = |(phi, l): (&f32, &u32)| if *l == label { *phi } else { phi.abs().max(voxel) };
    let phi = whole.coefficients().iter().zip(labels).map(own).collect();
    let domain = whole.domain();
    let part = LevelSet::from_coefficients(domain.bounds, domain.resolution, phi);
    let mut part = part.unwrap_or_else(|| unreachable!("distances are finite"));
    part.redistance();
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Vec3, vec3};

    #[test]
    fn a_ring_and_the_ball_in_it_are_two_bodies_although_their_boxes_overlap() {
        let ring = |x: Vec3<f32>| vec3(vec3(x.x, x.y, 0.0).length() - 0.55, x.z, 0.0).length() - 0.14;
        let ball = |x: Vec3<f32>| x.length() - 0.3;
        let whole = LevelSet::from_samples(Aabb::cube(1.0), [61; 3], |x| ring(x).min(ball(x)));
        let found = parts(&whole, &Aabb::cube(1.0), &[NONE; 61 * 61 * 61]);
        assert_eq!(found.len(), 2);
        for k in 0..4000 {
            let t = k as f32;
            let x = vec3((0.7 * t).sin(), (1.3 * t).cos(), 0.4 * (2.1 * t).sin()) * 0.8;
            for (part, truth) in found.iter().zip([ring(x), ball(x)]) {
                if truth.abs() > 0.02 {
                    assert_eq!(part.is_inside(x), truth < 0.0, "{x:?} {truth}");
                }
            }
        }
    }

    #[test]
    fn a_hull_that_grew_together_is_divided_where_a_stricter_one_has_two_large_parts() {
        let ball = |x: Vec3<f32>, at: f32, radius: f32| (x - vec3(at, 0.0, 0.0)).length() - radius;
        let count = |other: f32, strict: f32| {
            let hull = |x: Vec3<f32>, thicker: f32| {
                ball(x, -0.42, 0.37 + thicker).min(ball(x, 0.42, other + thicker))
            };
            let whole = LevelSet::from_samples(Aabb::cube(1.0), [61; 3], |x| hull(x, 0.15));
            let cores = cores([61; 3], |j| hull(whole.position(j), strict) < 0.0);
            let found = parts(&whole, &Aabb::cube(1.0), &cores);
            let is_inside = |x: f32| found.iter().filter(|p| p.is_inside(vec3(x, 0.0, 0.0))).count();
            assert_eq!([is_inside(-0.2), is_inside(0.3)], [1; 2], "each place is in one of them");
            found.len()
        };
        assert_eq!(count(0.37, 0.0), 2);
        assert_eq!(count(0.3, 0.0), 2);
        assert_eq!(count(0.37, 0.1), 1, "nothing shows them apart");
        assert_eq!(count(0.21, 0.0), 1, "an appendage");
    }

    #[test]
    fn one_body_stays_as_it_is_and_specks_and_what_lies_elsewhere_are_none() {
        let nothing = [NONE; 41 * 41 * 41];
        let alone = LevelSet::from_samples(Aabb::cube(1.0), [41; 3], |x| x.length() - 0.4);
        assert!(parts(&alone, &Aabb::cube(1.0), &nothing)[0].coefficients() == alone.coefficients());
        let others = |x: Vec3<f32>| {
            let speck = (x - vec3(0.0, 0.7, 0.0)).length() - 0.06;
            (x.length() - 0.4).min(speck).min((x - vec3(0.75, 0.0, 0.0)).length() - 0.2)
        };
        let whole = LevelSet::from_samples(Aabb::cube(1.0), [41; 3], others);
        let here = Aabb::cube(0.6);
        let found = parts(&whole, &here, &nothing);
        assert_eq!(found.len(), 1);
        assert!(found[0].is_inside(vec3(0.2, 0.1, 0.0)));
        assert!(!found[0].is_inside(vec3(0.75, 0.0, 0.0)) && !found[0].is_inside(vec3(0.0, 0.7, 0.0)));
    }
}
