//! Where the nodes and cells of a grid of coefficients lie, and how far each cell is from the nearest *marked* one.
//!
//! A cell is marked if a ray must not hop over it: in an index grid because its coefficients differ, in a level set because
//! it may hold the surface.

use super::vacuum::BORDER;
use crate::{Aabb, Domain, Extent, Real, Vec3};

/// A hop into a cell goes this much deeper [voxel]: far enough for the cell to be recognised after rounding in `f32`.
pub const NUDGE: f64 = 1.0 / 256.0;

/// Nodes from face to face of a box, x fastest, and one distance per cell, n − 1 per axis, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattice<T: Copy> {
    /// The box and the number of nodes per axis.
    pub domain: Domain<T>,
    /// Nodes per scene unit along each axis.
    pub scale: Vec3<T>,
    /// Chebyshev distance [cell] from each cell to the nearest marked one: 0 if it is marked itself. At most
    /// [`super::flat::FAR`].
    pub(super) clearance: Vec<u8>,
}

impl<T: Real> Lattice<T> {
    /// A lattice without marked cells.
    ///
    /// # Panics
    /// If `resolution` leaves no node between the borders (less than 7 on an axis).
    pub fn new(bounds: Aabb<T>, resolution: [u32; 3]) -> Self {
        assert!(
            resolution.iter().all(|&n| n as usize > 2 * BORDER),
            "an index grid needs more than {} nodes per axis, got {resolution:?}",
            2 * BORDER
        );
        let domain = Domain { bounds, extent: Extent::Bounded, resolution };
        let scale = domain.nodes_per_unit().hadamard(domain.unit_per_world());
        Self { domain, scale, clearance: super::flat::everywhere(resolution.map(|n| n as usize)) }
    }

    /// The same lattice in another precision.
    pub fn cast<U: Real>(&self) -> Lattice<U> {
        Lattice { domain: self.domain.cast(), scale: self.scale.cast(), clearance: self.clearance.clone() }
    }

    /// Nodes per axis.
    pub fn nodes(&self) -> [usize; 3] {
        self.domain.resolution.map(|n| n as usize)
    }
    /// Number of nodes.
    pub fn total(&self) -> usize {
        self.nodes().iter().product()
    }

    /// Coordinates (x, y, z) of a node from its index.
    pub fn coordinates(&self, node: usize) -> [usize; 3] {
        let n = self.nodes();
        [node % n[0], node / n[0] % n[1], node / (n[0] * n[1])]
    }
    /// World position of a node [scene unit].
    pub fn position(&self, node: usize) -> Vec3<T> {
        let i = Vec3::from(self.coordinates(node).map(|i| T::of(i as f64)));
        self.domain.bounds.min + i.zip(self.scale, |i, s| i / s)
    }
    /// False for the nodes of the border, the three outermost layers.
    pub fn is_inner(&self, node: usize) -> bool {
        let (i, n) = (self.coordinates(node), self.nodes());
        (0..3).all(|a| (BORDER..n[a] - BORDER).contains(&i[a]))
    }
    /// The nodes at least `border` away from the faces, in increasing order.
    pub fn inner(&self, border: usize) -> impl Iterator<Item = usize> + use<T> {
        let n = self.nodes();
        let [fx, fy, fz] = n.map(|n| border..n - border);
        fz.flat_map(move |z| {
            let fx = fx.clone();
            fy.clone().flat_map(move |y| fx.clone().map(move |x| x + n[0] * (y + n[1] * z)))
        })
    }

    /// Node coordinates of a world point.
    #[inline(always)]
    pub fn node(&self, x: Vec3<T>) -> Vec3<T> {
        (x - self.domain.bounds.min).hadamard(self.scale)
    }
    /// Cell that contains node coordinates `g`; `None` outside the box.
    #[inline(always)]
    pub fn cell(&self, g: Vec3<T>) -> Option<[usize; 3]> {
        let n = self.domain.resolution;
        let inside = (0..3).all(|a| g[a] >= T::zero() && g[a] <= T::of(f64::from(n[a] - 1)));
        inside.then(|| std::array::from_fn(|a| (g[a].f64() as u32).min(n[a] - 2) as usize))
    }
    /// True for the cells along the faces of the box, whose stencils would reach beyond it.
    #[inline(always)]
    pub fn is_rim(&self, cell: [usize; 3]) -> bool {
        (0..3).any(|a| cell[a] == 0 || cell[a] == self.domain.resolution[a] as usize - 2)
    }
    /// Distance [cell] from the cell at node coordinates `g` to the nearest marked one; `None` outside the box.
    #[inline(always)]
    pub fn clearance_at(&self, g: Vec3<T>) -> Option<u8> {
        Some(self.clearance_of(self.cell(g)?))
    }
    /// Distance [cell] from a cell to the nearest marked one.
    #[inline(always)]
    fn clearance_of(&self, c: [usize; 3]) -> u8 {
        let n = self.domain.resolution.map(|n| n as usize - 1);
        self.clearance[c[0] + n[0] * (c[1] + n[1] * c[2])]
    }

    /// The first t in `[from, end)` at which the line x + t p lies in a marked cell. Skips by clearance: a block of cells
    /// that holds no marked one is left through its nearest face.
    pub fn first_marked(&self, x: Vec3<T>, p: Vec3<T>, [from, end]: [T; 2]) -> Option<T> {
        let velocity = p.hadamard(self.scale);
        let nudge = T::of(NUDGE) / velocity.map(T::abs).max_element();
        let start = self.node(x);
        let inverse = velocity.map(T::recip);
        let last = self.domain.resolution.map(|n| T::of(f64::from(n - 1)));
        let mut t = from;
        while t < end {
            let mut g = start + velocity * t;
            for a in 0..3 {
                g[a] = g[a].max(T::zero()).min(last[a]);
            }
            let cell = self.cell(g)?;
            let clearance = self.clearance_of(cell);
            if clearance == 0 {
                return Some(t);
            }
            // No cell at a distance < clearance is marked: leave their block.
            let mut leave = T::infinity();
            for a in (0..3).filter(|&a| velocity[a] != T::zero()) {
                let (ahead, behind) = (f64::from(clearance), 1.0 - f64::from(clearance));
                let face = cell[a] as f64 + if velocity[a] > T::zero() { ahead } else { behind };
                leave = leave.min((T::of(face) - g[a]) * inverse[a]);
            }
            t += leave + nudge;
        }
        None
    }
}
