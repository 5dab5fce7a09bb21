//! The bodies of a hull: its connected parts, each with a surface of its own.

use refraxel_core::{Aabb, LevelSet};

/// Parts with fewer nodes than this share of the largest are specks.
const SPECK: f32 = 0.02;
/// So are parts of fewer nodes than this.
const LEAST: usize = 27;

/// No part.
pub(crate) const NONE: u32 = u32::MAX;

/// One level set per connected part of a body (nodes inside that touch along an axis), the largest first, all on the grid of
/// the whole. Specks, and parts of which less than half lies in the box where something was found, are none. A body of one
/// part stays as it is.
pub(super) fn parts(whole: &LevelSet<f32>, found: &Aabb<f32>) -> Vec<LevelSet<f32>> {
    let n = whole.domain().resolution.map(|n| n as usize);
    let phi = whole.coefficients();
    let (mut labels, sizes) = connected(n, |j| phi[j] < 0.0);
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

    const CUBE: Aabb<f32> =
        Aabb { min: Vec3 { x: -1.0, y: -1.0, z: -1.0 }, max: Vec3 { x: 1.0, y: 1.0, z: 1.0 } };

    #[test]
    fn a_ring_and_the_ball_in_it_are_two_bodies_although_their_boxes_overlap() {
        let ring = |x: Vec3<f32>| vec3(vec3(x.x, x.y, 0.0).length() - 0.55, x.z, 0.0).length() - 0.14;
        let ball = |x: Vec3<f32>| x.length() - 0.3;
        let whole = LevelSet::from_samples(CUBE, [61; 3], |x| ring(x).min(ball(x)));
        let found = parts(&whole, &CUBE);
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
    fn one_body_stays_as_it_is_and_specks_and_what_lies_elsewhere_are_none() {
        let alone = LevelSet::from_samples(CUBE, [41; 3], |x| x.length() - 0.4);
        assert!(parts(&alone, &CUBE)[0].coefficients() == alone.coefficients());
        let others = |x: Vec3<f32>| {
            let speck = (x - vec3(0.0, 0.7, 0.0)).length() - 0.06;
            (x.length() - 0.4).min(speck).min((x - vec3(0.75, 0.0, 0.0)).length() - 0.2)
        };
        let whole = LevelSet::from_samples(CUBE, [41; 3], others);
        let here = Aabb::new(Vec3::splat(-0.6), Vec3::splat(0.6));
        let found = parts(&whole, &here);
        assert_eq!(found.len(), 1);
        assert!(found[0].is_inside(vec3(0.2, 0.1, 0.0)));
        assert!(!found[0].is_inside(vec3(0.75, 0.0, 0.0)) && !found[0].is_inside(vec3(0.0, 0.7, 0.0)));
    }
}
