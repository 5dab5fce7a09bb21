//! Sparse topology of a voxel grid: which bricks of 4³ nodes are stored, and where.
//!
//! Most space is empty, so only some bricks of a grid are stored. Three tables answer the questions of a march: the brick
//! table says where a brick is stored or how far the next one is; the forward table says where the seven bricks at +x, +y,
//! +z of a brick are, into which its last cells reach; a constant table says which node of which of these bricks each
//! corner of a cell is.

/// Nodes along an edge of a brick.
pub const BRICK: u32 = 4;
/// Voxels of a brick. A voxel is a node with its parameters.
pub const BRICK_VOXELS: usize = 64;
/// The slot of all absent bricks. Its voxels hold the values of empty space and are never written, so that interpolation at
/// the border of the stored region needs no branch.
pub const EMPTY_SLOT: u32 = 0;

/// A cell of the grid, the cube between 2³ nodes, named by its lowest node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Slot of the brick that holds the lowest node.
    pub slot: u32,
    /// Index of the lowest node in its brick, `x + 4 y + 16 z` with coordinates from 0 to 3.
    pub local: u32,
}

/// The stored bricks of a grid with `resolution` nodes per axis.
///
/// Voxels are addressed by `slot * 64 + local`, `local = x + 4 y + 16 z` within the brick (x runs fastest). Slots follow
/// the Morton order of the bricks, so that neighbours in memory are neighbours in space. Slot 0 is [`EMPTY_SLOT`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrickMap {
    resolution: [u32; 3],
    /// Bricks per axis.
    bricks: [u32; 3],
    /// One entry per brick of the grid, x fastest.
    table: Vec<Entry>,
    /// Brick coordinates of each slot; without meaning for slot 0.
    brick_of_slot: Vec<[u32; 3]>,
    /// For each slot the first voxels of the bricks at +x (bit 0), +y (bit 1), +z (bit 2); entry 0 is its own.
    forward: Vec<[u32; 8]>,
}

/// An entry of the brick table in one word: the slot of the brick if > 0, otherwise minus the Chebyshev distance [brick] to
/// the nearest stored brick, at most 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry(i32);

impl Entry {
    /// `Ok` with the slot of the brick, or `Err` with the distance [brick] to the nearest stored one.
    #[inline(always)]
    pub fn slot(self) -> Result<u32, u32> {
        if self.0 > 0 { Ok(self.0 as u32) } else { Err(self.0.unsigned_abs()) }
    }
}

/// The corners of a cell at one position in its brick: in which forward brick each corner lies (bit a: the next one along
/// axis a), and where in it. The cells at coordinate 3 reach into the next brick.
#[derive(Clone, Copy)]
struct CellCorners {
    brick: [u32; 8],
    local: [u32; 8],
}

/// The corners of the cell at each local index.
const CORNERS: [CellCorners; BRICK_VOXELS] = {
    let mut table = [CellCorners { brick: [0; 8], local: [0; 8] }; BRICK_VOXELS];
    let mut l = 0;
    while l < BRICK_VOXELS {
        let mut k = 0;
        while k < 8 {
            let mut axis = 0;
            while axis < 3 {
                let n = (l as u32 >> (2 * axis) & 3) + (k as u32 >> axis & 1);
                table[l].brick[k] |= (n >> 2) << axis;
                table[l].local[k] |= (n & 3) << (2 * axis);
                axis += 1;
            }
            k += 1;
        }
        l += 1;
    }
    table
};

impl BrickMap {
    /// The map of the bricks for which `keep(brick coordinates)` holds, in Morton order.
    pub fn new(resolution: [u32; 3], keep: impl Fn([u32; 3]) -> bool) -> Self {
        let bricks = resolution.map(|n| n.div_ceil(BRICK));
        let mut kept: Vec<[u32; 3]> = coordinates(bricks).filter(|&b| keep(b)).collect();
        kept.sort_unstable_by_key(|&b| morton(b));
        Self::from_bricks(resolution, kept)
    }

    /// The map with all bricks.
    pub fn dense(resolution: [u32; 3]) -> Self {
        Self::new(resolution, |_| true)
    }

    /// The map with exactly these bricks, in this order of slots (from slot 1 on); `None` if one lies outside the grid
    /// or occurs twice.
    pub fn with_bricks(resolution: [u32; 3], kept: Vec<[u32; 3]>) -> Option<Self> {
        let bricks = resolution.map(|n| n.div_ceil(BRICK));
        let mut seen = std::collections::HashSet::with_capacity(kept.len());
        let valid = kept.iter().all(|b| (0..3).all(|a| b[a] < bricks[a]) && seen.insert(*b));
        valid.then(|| Self::from_bricks(resolution, kept))
    }

    /// The map with these bricks in this order, which lie inside the grid and differ from each other.
    fn from_bricks(resolution: [u32; 3], kept: Vec<[u32; 3]>) -> Self {
        let bricks = resolution.map(|n| n.div_ceil(BRICK));
        let total = bricks.iter().map(|&n| n as usize).product();
        let mut map = Self {
            resolution,
            bricks,
            table: vec![Entry(0); total],
            brick_of_slot: std::iter::once([0; 3]).chain(kept).collect(),
            forward: Vec::new(),
        };
        let mut distance = vec![u8::MAX; total];
        for &brick in map.bricks() {
            distance[map.table_index(brick)] = 0;
        }
        spread_distance(&mut distance, bricks);
        map.table = distance.into_iter().map(|d| Entry(-i32::from(d))).collect();
        for slot in 1..map.brick_of_slot.len() {
            let at = map.table_index(map.brick_of_slot[slot]);
            map.table[at] = Entry(slot as i32);
        }
        map.forward = (0..map.slots()).map(|s| map.forward_of(s as u32)).collect();
        map
    }

    /// The row of the forward table of a slot.
    fn forward_of(&self, slot: u32) -> [u32; 8] {
        let b = self.brick_of_slot[slot as usize];
        let mut out = [EMPTY_SLOT; 8];
        if slot != EMPTY_SLOT {
            for (k, o) in out.iter_mut().enumerate() {
                let k = k as u32;
                *o = self.slot([b[0] + (k & 1), b[1] + (k >> 1 & 1), b[2] + (k >> 2)]) * BRICK_VOXELS as u32;
            }
        }
        out
    }

    /// Nodes per axis.
    pub fn resolution(&self) -> [u32; 3] {
        self.resolution
    }
    /// Number of slots, the empty one included.
    pub fn slots(&self) -> usize {
        self.brick_of_slot.len()
    }
    /// Number of stored voxels, the empty brick's included: the length of every per-voxel array.
    pub fn voxels(&self) -> usize {
        self.slots() * BRICK_VOXELS
    }
    /// Coordinates of the stored bricks in the order of slots, without the empty one.
    pub fn bricks(&self) -> &[[u32; 3]] {
        &self.brick_of_slot[1..]
    }
    /// Coordinates of a slot's brick.
    pub fn brick_of(&self, slot: u32) -> [u32; 3] {
        self.brick_of_slot[slot as usize]
    }
    /// Slot of a brick; [`EMPTY_SLOT`] where there is none, also outside the grid.
    pub fn slot(&self, brick: [u32; 3]) -> u32 {
        if (0..3).any(|a| brick[a] >= self.bricks[a]) {
            return EMPTY_SLOT;
        }
        self.table[self.table_index(brick)].slot().unwrap_or(EMPTY_SLOT)
    }
    /// Index into the brick table of brick coordinates inside the grid.
    #[inline(always)]
    fn table_index(&self, b: [u32; 3]) -> usize {
        (b[0] + self.bricks[0] * (b[1] + self.bricks[1] * b[2])) as usize
    }

    /// Index of a node in the per-voxel arrays; a voxel of the empty brick where the node is not stored.
    pub fn voxel(&self, node: [u32; 3]) -> usize {
        let slot = self.slot(node.map(|n| n / BRICK));
        slot as usize * BRICK_VOXELS + local_index(node) as usize
    }

    /// The node of an index in the per-voxel arrays; those of the empty brick have none.
    pub fn node(&self, voxel: usize) -> [u32; 3] {
        let brick = self.brick_of_slot[voxel / BRICK_VOXELS];
        [0, 1, 2].map(|a| BRICK * brick[a] + (voxel as u32 >> (2 * a) & (BRICK - 1)))
    }

    /// Bricks along each axis of the grid.
    pub fn bricks_per_axis(&self) -> [u32; 3] {
        self.bricks
    }

    /// The brick table as shaders read it, the words of its [`Entry`]s: for each brick of the grid its slot, or minus a distance.
    pub fn table_words(&self) -> impl Iterator<Item = i32> {
        self.table.iter().map(|entry| entry.0)
    }

    /// Strides of the brick table: its index for brick coordinates (x, y, z) is their inner product with these.
    #[inline(always)]
    pub fn brick_strides(&self) -> [u32; 3] {
        [1, self.bricks[0], self.bricks[0] * self.bricks[1]]
    }

    /// The entry at an index of the brick table, see [`Self::brick_strides`].
    #[inline(always)]
    pub fn entry(&self, table_index: usize) -> Entry {
        self.table[table_index]
    }

    /// The cell with lowest node `node`, which must lie inside the grid; `None` if its brick is not stored.
    #[inline(always)]
    pub fn cell(&self, node: [u32; 3]) -> Option<Cell> {
        let slot = self.entry(self.table_index(node.map(|n| n / BRICK))).slot().ok()?;
        Some(Cell { slot, local: local_index(node) })
    }

    /// The forward table: for each slot the first voxels of its brick and of the seven bricks after it. Public so that a
    /// backend can fetch ahead what [`Self::corners`] reads.
    #[inline(always)]
    pub fn forward_rows(&self) -> &[[u32; 8]] {
        &self.forward
    }

    /// Voxel indices of the eight corners of a cell; corner k is at +x for bit 0, +y for bit 1, +z for bit 2.
    /// A cell of the empty brick gives voxels of the empty brick.
    #[inline(always)]
    pub fn corners(&self, cell: Cell) -> [u32; 8] {
        let (first, at) = (&self.forward[cell.slot as usize], &CORNERS[cell.local as usize & 63]);
        let mut out = [0; 8];
        for k in 0..8 {
            out[k] = first[at.brick[k] as usize & 7] + at.local[k];
        }
        out
    }

    /// Memory of the map itself [byte], without voxel data.
    pub fn bytes(&self) -> usize {
        self.table.len() * 4 + self.slots() * (12 + 32)
    }
}

/// Index of a node within its brick, `x + 4 y + 16 z`.
#[inline(always)]
pub fn local_index(node: [u32; 3]) -> u32 {
    (node[0] & 3) | (node[1] & 3) << 2 | (node[2] & 3) << 4
}

/// The coordinates of a box of `n` items per axis, x fastest.
pub fn coordinates(n: [u32; 3]) -> impl Iterator<Item = [u32; 3]> {
    (0..n[2]).flat_map(move |z| (0..n[1]).flat_map(move |y| (0..n[0]).map(move |x| [x, y, z])))
}

/// Morton code of three coordinates below 2²¹: their bits, interleaved. Sorting by it keeps neighbours in space close in
/// memory.
fn morton(b: [u32; 3]) -> u64 {
    let spread = |v: u32| (0..21).fold(0, |m, k| m | u64::from(v >> k & 1) << (3 * k));
    spread(b[0]) | spread(b[1]) << 1 | spread(b[2]) << 2
}

/// Chebyshev distance transform, exact, in place: from 0 in stored bricks and 255 elsewhere to the distances [brick], for
/// `n` bricks per axis, x fastest.
fn spread_distance(distance: &mut [u8], n: [u32; 3]) {
    // The distance to a set is the minimum over its members of max(|dx|, |dy|, |dz|), which can be taken axis by axis.
    let strides = [1, n[0] as usize, (n[0] * n[1]) as usize];
    let mut line = Vec::new();
    for axis in 0..3 {
        let len = n[axis] as usize;
        for start in 0..distance.len() {
            if !(start / strides[axis]).is_multiple_of(len) {
                continue;
            }
            line.clear();
            line.extend((0..len).map(|i| distance[start + i * strides[axis]]));
            for i in 0..len {
                distance[start + i * strides[axis]] = nearest_on_line(&line, i);
            }
        }
    }
}

/// min over j of max(line[j], |i − j|), searched outwards until no farther j can win.
fn nearest_on_line(line: &[u8], i: usize) -> u8 {
    let mut best = line[i];
    for r in 1..line.len().max(1) {
        if r >= usize::from(best) {
            break;
        }
        let candidates = [i.checked_sub(r), Some(i + r).filter(|&j| j < line.len())];
        for j in candidates.into_iter().flatten() {
            best = best.min(line[j].max(r as u8));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_agree_with_the_voxels_of_the_nodes() {
        let keep = |b: [u32; 3]| !(b[0] + 2 * b[1] + 3 * b[2]).is_multiple_of(5);
        let map = BrickMap::new([13, 9, 18], keep);
        for node in coordinates([12, 8, 17]) {
            let Some(cell) = map.cell(node) else { continue };
            for (k, &voxel) in map.corners(cell).iter().enumerate() {
                let k = k as u32;
                let corner = [node[0] + (k & 1), node[1] + (k >> 1 & 1), node[2] + (k >> 2)];
                assert_eq!(voxel as usize, map.voxel(corner), "cell {node:?}, corner {k}");
            }
        }
    }

    #[test]
    fn distance_is_the_chebyshev_distance_to_the_nearest_brick() {
        let stored = [[1, 2, 3], [6, 0, 5]];
        let map = BrickMap::new([40, 32, 28], |b| stored.contains(&b));
        for b in coordinates([10, 8, 7]) {
            let want =
                stored.iter().map(|s| (0..3).map(|a| s[a].abs_diff(b[a])).max().unwrap()).min().unwrap();
            let found = map.entry(map.table_index(b)).slot().err().unwrap_or(0);
            assert_eq!(found, want, "brick {b:?}");
        }
    }

    #[test]
    fn a_map_is_rebuilt_from_its_bricks() {
        let map = BrickMap::new([33, 17, 20], |b| (b[0] ^ b[1] ^ b[2]) & 1 == 0);
        assert_eq!(BrickMap::with_bricks(map.resolution(), map.bricks().to_vec()), Some(map.clone()));
        assert_eq!(BrickMap::with_bricks([8, 8, 8], vec![[0, 0, 0], [0, 0, 0]]), None);
        assert_eq!(BrickMap::with_bricks([8, 8, 8], vec![[2, 0, 0]]), None);
    }

    #[test]
    fn the_dense_map_stores_every_node_once() {
        let map = BrickMap::dense([9, 5, 6]);
        let mut seen: Vec<usize> = coordinates([9, 5, 6]).map(|n| map.voxel(n)).collect();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), 9 * 5 * 6);
        assert!(seen[0] >= BRICK_VOXELS, "no node lies in the empty brick");
    }
}
