//! What the grid stores as lines: where the outline of its bricks turns.

use super::protocol::Tell;
use super::scene::Scene;
use refraxel_core::grid::BRICK;
use refraxel_core::{BrickMap, Domain, Extent, Vec3};
use refraxel_train::Backend;

/// Lines that are drawn; where there are more, larger blocks are outlined.
const MOST: usize = 6000;

/// The outline of the stored bricks in the user's world.
pub fn bricks(scene: &Scene) -> Tell {
    let (map, domain) = (scene.backend().map(), scene.backend().domain().cast::<f64>());
    let mut size = 1;
    let mut creases = Blocks::of(map, size).creases();
    while creases.len() > MOST {
        size *= 2;
        creases = Blocks::of(map, size).creases();
    }
    let edge = size * BRICK;
    let place = |corner: [u32; 3]| {
        let node = Vec3::from([0, 1, 2].map(|k| f64::from((corner[k] * edge).min(domain.resolution[k] - 1))));
        scene.origin().to_world(domain.position(node))
    };
    let lines = creases.into_iter().flat_map(|crease| crease.parts(&domain)).map(|ends| {
        let [a, b] = ends.map(|corner| place(corner).to_array().map(|x| x as f32));
        [a[0], a[1], a[2], b[0], b[1], b[2]]
    });
    Tell::Bricks { lines: lines.collect(), edge }
}

/// Which blocks of bricks hold any that is stored.
struct Blocks {
    /// Blocks per axis.
    count: [u32; 3],
    /// x fastest.
    filled: Vec<bool>,
}

/// A line along an axis between two corners of blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Crease {
    from: [u32; 3],
    axis: usize,
    /// Its length [block].
    length: u32,
}

impl Blocks {
    /// Blocks of `size` bricks along each axis.
    fn of(map: &BrickMap, size: u32) -> Self {
        let count = map.resolution().map(|n| n.div_ceil(BRICK).div_ceil(size));
        let mut blocks = Self { count, filled: vec![false; count.iter().map(|&n| n as usize).product()] };
        for brick in map.bricks() {
            let [x, y, z] = brick.map(|k| k / size);
            blocks.filled[(x + count[0] * (y + count[1] * z)) as usize] = true;
        }
        blocks
    }

    /// Whether a block is filled; those before the first and behind the last are not.
    fn is_filled(&self, at: [Option<u32>; 3]) -> bool {
        let [Some(x), Some(y), Some(z)] = at else { return false };
        let is_inside = [x, y, z].iter().zip(self.count).all(|(k, n)| *k < n);
        is_inside && self.filled[(x + self.count[0] * (y + self.count[1] * z)) as usize]
    }

    /// Where the outline turns: of the four blocks around an edge one or three are filled, or two that meet there alone.
    fn turns(&self, corner: [u32; 3], axis: usize) -> bool {
        let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
        let around = |db: u32, dc: u32| {
            let mut at = corner.map(Some);
            (at[b], at[c]) = (corner[b].checked_sub(db), corner[c].checked_sub(dc));
            self.is_filled(at)
        };
        let [p, q, r, s] = [around(0, 0), around(1, 0), around(0, 1), around(1, 1)];
        (p ^ q ^ r ^ s) || (p == s && q == r && p != q)
    }

    fn creases(&self) -> Vec<Crease> {
        let mut creases: Vec<Crease> = Vec::new();
        for axis in 0..3 {
            let [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
            for (j, k) in (0..=self.count[c]).flat_map(|k| (0..=self.count[b]).map(move |j| (j, k))) {
                let mut open: Option<Crease> = None;
                for i in 0..self.count[axis] {
                    let mut corner = [0; 3];
                    (corner[axis], corner[b], corner[c]) = (i, j, k);
                    if !self.turns(corner, axis) {
                        creases.extend(open.take());
                        continue;
                    }
                    open.get_or_insert(Crease { from: corner, axis, length: 0 }).length += 1;
                }
                creases.extend(open);
            }
        }
        creases
    }
}

impl Crease {
    /// In pieces that are straight in the world: whole in a box, block by block in space that is contracted.
    fn parts(self, domain: &Domain<f64>) -> Vec<[[u32; 3]; 2]> {
        let at = |k: u32| {
            let mut corner = self.from;
            corner[self.axis] += k;
            corner
        };
        match domain.extent {
            Extent::Bounded => vec![[at(0), at(self.length)]],
            _ => (0..self.length).map(|k| [at(k), at(k + 1)]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_are_outlined_and_faces_between_them_are_not() {
        let creases = |kept: &[[u32; 3]]| {
            let map = BrickMap::with_bricks([16; 3], kept.to_vec()).unwrap();
            Blocks::of(&map, 1).creases()
        };
        assert_eq!(creases(&[]).len(), 0);
        assert_eq!(creases(&[[3, 0, 1]]).len(), 12);
        // Two side by side are one box, whose long edges are each one line.
        let two = creases(&[[1, 1, 1], [2, 1, 1]]);
        assert_eq!((two.len(), two.iter().filter(|c| c.length == 2).count()), (12, 4));
        assert!(two.contains(&Crease { from: [1, 1, 1], axis: 0, length: 2 }));
        // Two that meet at an edge have it in common, and four lines go on from one to the other.
        assert_eq!(creases(&[[1, 1, 1], [2, 2, 1]]).len(), 19);
    }

    #[test]
    fn larger_blocks_hold_every_brick_that_is_stored() {
        let map = BrickMap::with_bricks([16, 16, 8], vec![[3, 0, 1], [2, 1, 0]]).unwrap();
        let blocks = Blocks::of(&map, 2);
        assert_eq!((blocks.count, blocks.filled), ([2, 2, 1], vec![false, true, false, false]));
    }
}
