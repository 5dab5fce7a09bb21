//! The things among what straight rays do not explain: the largest connected parts of a hull.

use super::Hints;
use crate::level_set::half_full;
use crate::model::Gate;
use crate::refraction_search::{NONE, connected, neighbours};
use crate::silhouettes::{Outlines, Vote};
use rayon::prelude::*;
use refraxel_core::{Aabb, Domain, Extent, LevelSet, Ray, Vec3};

/// Parts of less than this share of the largest are none: highlights, and places that few views see.
const SPECK: f32 = 0.1;
/// So are parts of fewer nodes.
const LEAST: usize = 30;
/// What somebody points at has at least so many.
const POINTED_AT: usize = 8;
/// Least share of the views that must see a place.
const SEEN: f32 = 0.3;
/// Room around what was found, in its longest edge.
const MARGIN: f32 = 0.2;

/// Things that were carved.
pub(super) struct Carved {
    pub gate: Gate,
    /// Their box, with room around.
    pub bounds: Aabb<f32>,
}

impl Carved {
    /// What lies in a gate; `None` if nothing does. Their box stays in `bounds`.
    pub fn of(gate: &Gate, bounds: &Aabb<f32>) -> Option<Self> {
        let domain = gate.domain();
        let inside = gate.values().iter().enumerate().filter(|(_, f)| **f > 127);
        let found = Aabb::around(inside.map(|(j, _)| domain.place(j)))?;
        let room = Vec3::splat(MARGIN * found.extent().max_element() + 2.0 * domain.voxel());
        let bounds = Aabb::new((found.min - room).max(bounds.min), (found.max + room).min(bounds.max));
        Some(Self { gate: gate.clone(), bounds })
    }

    /// Its surface; distances are right up to half a voxel.
    pub fn surface(&self) -> LevelSet<f32> {
        half_full(self.gate.domain(), |j| f32::from(self.gate.values()[j]) / 255.0)
    }
}

/// The things in a box on which each of some shares of the views agrees; none without any.
pub(super) fn bodies<const N: usize>(
    outlines: &Outlines,
    bounds: &Aabb<f32>,
    shares: [f32; N],
    nodes: u32,
    hints: &Hints,
) -> impl Iterator<Item = Carved> {
    let domain = Domain::with_longest(*bounds, Extent::Bounded, nodes);
    let hulls = outlines.hulls(&domain, &Vote { least: SEEN, ..Vote::default() }, shares);
    hulls.into_iter().filter_map(move |hull| kept(hull.fraction, &domain, bounds, hints))
}

/// The things among the nodes of a hull, of which this share is inside; `None` without any.
fn kept(mut fraction: Vec<f32>, domain: &Domain<f32>, bounds: &Aabb<f32>, hints: &Hints) -> Option<Carved> {
    let allowed = |node: usize| hints.allow(domain.place(node));
    fraction
        .par_iter_mut()
        .enumerate()
        .filter(|(node, f)| **f > 0.0 && !allowed(*node))
        .for_each(|(_, f)| *f = 0.0);
    keep_parts(&mut fraction, domain, hints);
    Carved::of(&Gate::new(*domain, &fraction), bounds)
}

/// Empties all but some parts of nodes that are at least half inside, with what surrounds them: the large ones, or those that
/// lines of sight meet first, where somebody knows some.
pub(super) fn keep_parts(fraction: &mut [f32], domain: &Domain<f32>, hints: &Hints) {
    let n = domain.resolution.map(|n| n as usize);
    let (labels, sizes) = connected(n, |node| fraction[node] >= 0.5);
    let largest = sizes.iter().copied().max().unwrap_or(0) as f32;
    let is_large = |size: usize| size >= LEAST && size as f32 >= SPECK * largest;
    let mut is_kept: Vec<bool> = sizes.iter().map(|size| is_large(*size)).collect();
    if !hints.clicks.is_empty() {
        let met: Vec<u32> =
            hints.clicks.iter().filter_map(|ray| first_part(&labels, &sizes, domain, ray)).collect();
        is_kept = (0..sizes.len()).map(|k| met.contains(&(k as u32))).collect();
    }
    let is_in = |node: usize| labels[node] != NONE && is_kept[labels[node] as usize];
    let keeps = |node: usize| is_in(node) || neighbours(node, n).any(is_in);
    let kept: Vec<bool> = (0..fraction.len()).map(keeps).collect();
    fraction.iter_mut().zip(kept).filter(|(_, keep)| !keep).for_each(|(f, _)| *f = 0.0);
}

/// The part of some nodes that a ray meets first.
fn first_part(labels: &[u32], sizes: &[usize], domain: &Domain<f32>, ray: &Ray<f32>) -> Option<u32> {
    let [enter, leave] = domain.bounds.clip(ray)?;
    let step = 0.5 * domain.voxel();
    let n = domain.resolution.map(|n| n as usize);
    let node = |s: f32| {
        let nearest = domain.node(ray.at(s)).map(f32::round).to_array();
        let [x, y, z] = [0, 1, 2].map(|a| (nearest[a].max(0.0) as usize).min(n[a] - 1));
        x + n[0] * (y + n[1] * z)
    };
    let steps = ((leave - enter) / step).ceil().max(0.0) as usize;
    (0..=steps)
        .map(|k| labels[node(enter + k as f32 * step)])
        .find(|l| *l != NONE && sizes[*l as usize] >= POINTED_AT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    #[test]
    fn lines_of_sight_choose_the_things_that_they_meet_first() {
        let bounds = Aabb::cube(1.0);
        let domain = Domain::with_longest(bounds, Extent::Bounded, 33);
        let middles = [vec3(-0.6, 0.0, 0.0), vec3(0.0, 0.0, 0.0), vec3(0.6, 0.0, 0.0)];
        let radii = [0.3, 0.2, 0.12];
        let total = 33 * 33 * 33;
        let fraction = |j: usize| {
            let x = domain.place(j);
            let inside = middles.iter().zip(radii).any(|(m, r)| (x - *m).length() < r);
            f32::from(u8::from(inside))
        };
        let kept = |clicks: Vec<Ray<f32>>| {
            let mut fraction: Vec<f32> = (0..total).map(fraction).collect();
            keep_parts(&mut fraction, &domain, &Hints { clicks, ..Hints::default() });
            let gate = Gate::new(domain, &fraction);
            middles.map(|m| gate.is_inside(m))
        };
        let along = |origin: Vec3<f32>, direction: Vec3<f32>| Ray { origin, direction };
        assert_eq!(kept(Vec::new()), [true, true, false], "the last one is a speck");
        assert_eq!(kept(vec![along(vec3(4.0, 0.0, 0.0), vec3(-1.0, 0.0, 0.0))]), [false, false, true]);
        let two = [-0.6, 0.0].map(|x| along(vec3(x, -3.0, 0.0), vec3(0.0, 1.0, 0.0)));
        assert_eq!(kept(two.to_vec()), [true, true, false]);
        assert_eq!(kept(vec![along(vec3(4.0, 0.0, 0.9), vec3(-1.0, 0.0, 0.0))]), [false; 3]);
    }
}
