//! A choice of voxels as data, which any device can read.

use refraxel_core::grid::BRICK_VOXELS;
use refraxel_core::{BrickMap, Domain, Vec3};

/// One bit per stored voxel: 64 bits per slot of a grid's map, x fastest within a brick.
#[derive(Clone, Debug, PartialEq)]
pub struct BrickMask {
    bits: Vec<u64>,
}

impl BrickMask {
    /// The stored voxels whose world position is `chosen`; never those of the empty brick.
    pub fn new(domain: &Domain<f32>, map: &BrickMap, chosen: impl Fn(Vec3<f32>) -> bool) -> Self {
        let mut bits = vec![0; map.slots()];
        for voxel in BRICK_VOXELS..map.voxels() {
            let node = map.node(voxel).map(|n| n as f32);
            let bit = u64::from(chosen(domain.position(Vec3::from(node))));
            bits[voxel / BRICK_VOXELS] |= bit << (voxel % BRICK_VOXELS);
        }
        Self { bits }
    }

    /// The bits of each slot, the empty one first.
    pub fn bits(&self) -> &[u64] {
        &self.bits
    }

    /// Indices of the chosen voxels in arrays with one value per voxel.
    pub fn voxels(&self) -> impl Iterator<Item = usize> + '_ {
        let of_slot = |(slot, bits): (usize, &u64)| {
            let bits = *bits;
            (0..BRICK_VOXELS)
                .filter(move |local| bits >> local & 1 != 0)
                .map(move |l| slot * BRICK_VOXELS + l)
        };
        self.bits.iter().enumerate().flat_map(of_slot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::{Aabb, Extent};

    #[test]
    fn a_mask_chooses_the_voxels_of_the_nodes_that_lie_there() {
        let cube = Aabb::cube(1.0);
        let domain = Domain::with_longest(cube, Extent::Bounded, 12);
        let map = BrickMap::new(domain.resolution, |b| b != [1, 1, 1]);
        let chosen = |x: Vec3<f32>| x.length() < 0.7;
        let mask = BrickMask::new(&domain, &map, chosen);
        let expected = refraxel_core::grid::bricks::coordinates(domain.resolution).filter(|node| {
            let stored = map.voxel(*node) >= BRICK_VOXELS;
            stored && chosen(domain.position(Vec3::from(node.map(|n| n as f32))))
        });
        let mut expected: Vec<usize> = expected.map(|node| map.voxel(node)).collect();
        expected.sort_unstable();
        let nodes = domain.resolution.map(|n| n as usize).iter().product::<usize>();
        assert!(!expected.is_empty() && expected.len() < nodes);
        assert_eq!(mask.voxels().collect::<Vec<_>>(), expected);
    }
}
