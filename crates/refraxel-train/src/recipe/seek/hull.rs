//! The things among what straight rays do not explain: the largest connected parts of a hull.

use crate::initial::{Outlines, Vote};
use crate::model::Gate;
use crate::recipe::parts::{NONE, connected, neighbours};
use refraxel_core::{Aabb, Domain, Extent, LevelSet, Vec3};

/// Parts of less than this share of the largest are none: highlights, and places that few views see.
const SPECK: f32 = 0.1;
/// So are parts of fewer nodes.
const LEAST: usize = 30;
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
        let found = Aabb::around(inside.map(|(j, _)| domain.position(domain.coordinates(j))))?;
        let room = Vec3::splat(MARGIN * found.extent().max_element() + 2.0 * domain.voxel());
        let bounds = Aabb::new((found.min - room).max(bounds.min), (found.max + room).min(bounds.max));
        Some(Self { gate: gate.clone(), bounds })
    }

    /// Its surface; distances are right up to half a voxel.
    pub fn surface(&self) -> LevelSet<f32> {
        let domain = self.gate.domain();
        let distance = |share: &u8| (0.5 - f32::from(*share) / 255.0) * domain.voxel();
        let values = self.gate.values().iter().map(distance).collect();
        let surface = LevelSet::from_coefficients(domain.bounds, domain.resolution, values);
        surface.unwrap_or_else(|| unreachable!("distances are finite"))
    }
}

/// The things in a box on which a share of the views agrees; `None` without any.
pub(super) fn bodies(outlines: &Outlines, bounds: &Aabb<f32>, share: f32, nodes: u32) -> Option<Carved> {
    let domain = Domain::with_longest(*bounds, Extent::Bounded, nodes);
    let vote = Vote { share, least: SEEN, ..Vote::default() };
    let mut fraction = outlines.hull(&domain, &vote).fraction;
    keep_large_parts(&mut fraction, domain.resolution.map(|n| n as usize));
    Carved::of(&Gate::new(domain, &fraction), bounds)
}

/// Empties all but the large parts of nodes that are at least half inside, with what surrounds them.
pub(super) fn keep_large_parts(fraction: &mut [f32], n: [usize; 3]) {
    let (labels, sizes) = connected(n, |node| fraction[node] >= 0.5);
    let largest = sizes.iter().copied().max().unwrap_or(0) as f32;
    let is_large = |node: usize| {
        let size = if labels[node] == NONE { 0 } else { sizes[labels[node] as usize] };
        size >= LEAST && size as f32 >= SPECK * largest
    };
    let keeps = |node: usize| is_large(node) || neighbours(node, n).any(is_large);
    let kept: Vec<bool> = (0..fraction.len()).map(keeps).collect();
    fraction.iter_mut().zip(kept).filter(|(_, keep)| !keep).for_each(|(f, _)| *f = 0.0);
}
