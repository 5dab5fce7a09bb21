//! What an index grid is, and access to its parameters.

use crate::index::interpolation::Interpolation;
use crate::index::lattice::Lattice;
use crate::index::vacuum::{BORDER, VACUUM};
use crate::index::{LevelSet, flat};
use crate::{Aabb, Domain, Real, Vec3};

/// The index of refraction in one box, theory (2.4): w(x) = Σ_j c_j B_j(x), n = √(2w). Vacuum outside.
///
/// The coefficients c_j [1] lie on `resolution` nodes from face to face, x fastest. All positions are in the world, all
/// derivatives per scene unit. Requires w > 0 everywhere, which c > 0 ensures. The three outermost layers of nodes are no
/// parameters: they are held at vacuum.
///
/// With a [`LevelSet`] the grid is a *body*: its field holds where φ < 0, and n = 1 where φ > 0, theory (2.23). The
/// functions of x below return the field of the body wherever x is; [`Medium`](crate::Medium) asks on which side x lies.
/// All nodes of a body are parameters, for the border of the box lies outside the surface.
#[derive(Clone, Debug)]
pub struct IndexGrid<T: Copy> {
    /// Marks the cells that are not flat.
    pub(super) lattice: Lattice<T>,
    pub(super) interpolation: Interpolation,
    pub(super) coefficients: Vec<T>,
    /// Upper bound of n, as of the last [`IndexGrid::find_flat_cells`].
    largest_index: T,
    /// True where all cells are flat and none is free.
    is_uniform: bool,
    /// True where all coefficients are one number, as of the last [`IndexGrid::find_flat_cells`], and nobody could have changed them since:
    /// no stencil is needed then.
    pub(super) is_constant: bool,
    pub(super) level_set: Option<LevelSet<T>>,
    absorption: [T; 3],
}

impl<T: Real> IndexGrid<T> {
    /// A box of vacuum.
    ///
    /// # Panics
    /// If `resolution` leaves no node between the borders (less than 7 on an axis).
    pub fn vacuum(bounds: Aabb<T>, resolution: [u32; 3], interpolation: Interpolation) -> Self {
        let lattice = Lattice::new(bounds, resolution);
        let coefficients = vec![T::of(VACUUM); lattice.total()];
        Self {
            lattice,
            interpolation,
            coefficients,
            largest_index: T::one(),
            is_uniform: true,
            is_constant: true,
            level_set: None,
            absorption: [T::zero(); 3],
        }
    }

    /// The same field in another precision.
    pub fn cast<U: Real>(&self) -> IndexGrid<U> {
        IndexGrid {
            lattice: self.lattice.cast(),
            interpolation: self.interpolation,
            coefficients: self.coefficients.iter().map(|c| U::of(c.f64())).collect(),
            largest_index: U::of(self.largest_index.f64()),
            is_uniform: self.is_uniform,
            is_constant: self.is_constant,
            level_set: self.level_set.as_ref().map(LevelSet::cast),
            absorption: self.absorption.map(|a| U::of(a.f64())),
        }
    }

    /// The surface, if this is a body with one.
    pub fn level_set(&self) -> Option<&LevelSet<T>> {
        self.level_set.as_ref()
    }
    /// The surface, to be changed. Call [`LevelSet::find_surface`] afterwards.
    pub fn level_set_mut(&mut self) -> Option<&mut LevelSet<T>> {
        self.level_set.as_mut()
    }
    /// The index n, if it is the same everywhere (w differs by at most [`FLAT`](crate::index::FLAT) within a cell).
    pub fn interior_index(&self) -> Option<T> {
        self.is_uniform.then(|| (self.coefficients[0] + self.coefficients[0]).sqrt())
    }
    /// True where rays are straight all through the box.
    #[inline(always)]
    pub(crate) fn is_uniform(&self) -> bool {
        self.is_uniform
    }
    /// Gives the body one index n > 0. By dw = n dn the derivative with respect to it is n times the sum of those with
    /// respect to the coefficients.
    ///
    /// # Panics
    /// Without a level set, where the border is vacuum.
    pub fn set_interior_index(&mut self, index: T) {
        assert!(self.level_set.is_some(), "only a body with a surface has one index");
        self.coefficients.fill(T::of(0.5) * index * index);
        self.find_flat_cells(None);
    }

    /// The absorption coefficients of the body for red, green and blue [1 / scene unit], theory (7.17); 0 for clear glass.
    pub fn absorption(&self) -> [T; 3] {
        self.absorption
    }
    /// Gives the body these absorption coefficients [1 / scene unit].
    ///
    /// # Panics
    /// Unless they are finite and not negative: nothing amplifies light.
    pub fn set_absorption(&mut self, absorption: [T; 3]) {
        let is_valid = |a: &T| a.is_finite() && *a >= T::zero();
        assert!(absorption.iter().all(is_valid), "absorption is finite and >= 0, got {absorption:?}");
        self.absorption = absorption;
    }

    /// The box and the number of nodes per axis.
    pub fn domain(&self) -> &Domain<T> {
        &self.lattice.domain
    }
    /// How w follows from the coefficients.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }
    /// The coefficients of w [1], one per node, x fastest.
    pub fn coefficients(&self) -> &[T] {
        &self.coefficients
    }
    /// The coefficients, to be changed. Leave the border as it is ([`Self::is_parameter`]), and call
    /// [`Self::find_flat_cells`] afterwards: until then rays still hop where the field used to be flat.
    pub fn coefficients_mut(&mut self) -> &mut [T] {
        self.is_constant = false;
        &mut self.coefficients
    }

    /// Finds again which cells are flat (differences of w at most [`FLAT`](crate::index::FLAT)). Rays cross flat cells in one
    /// hop, so that the coefficients inside a flat region get no gradient.
    ///
    /// `free`, one per node, names coefficients that shall get their gradient: cells that depend on one of them are marched
    /// even if flat. Beside an edge, grids of [`Self::from_samples`] have ripples that take about 10 voxels to fade; grids of
    /// [`Self::from_control_values`] are flat 2 voxels away.
    pub fn find_flat_cells(&mut self, free: Option<&[bool]>) {
        self.lattice.clearance = flat::clearance(&self.coefficients, self.lattice.nodes(), free);
        self.find_uniformity(self.lattice.clearance.iter().all(|&d| d == flat::FAR));
        let largest = self.coefficients.iter().copied().fold(T::of(VACUUM), T::max);
        self.largest_index = (largest + largest).sqrt();
    }

    fn find_uniformity(&mut self, is_uniform: bool) {
        self.is_uniform = is_uniform;
        self.is_constant = is_uniform && self.coefficients.iter().all(|c| *c == self.coefficients[0]);
    }

    /// Per cell (n − 1 per axis, x fastest) the Chebyshev distance [cell] to the nearest one that rays march, which is 0 for those.
    pub fn clearances(&self) -> &[u8] {
        &self.lattice.clearance
    }
    /// Per cell (n − 1 per axis, x fastest) whether rays march it, as of the last [`Self::find_flat_cells`]. With
    /// [`Self::largest_index`] it says how rays move where the coefficients have changed since.
    pub fn marched_cells(&self) -> Vec<bool> {
        self.lattice.clearance.iter().map(|d| *d == 0).collect()
    }

    /// Sets what an earlier [`Self::find_flat_cells`] found. False, without a change, unless there is one flag per cell and
    /// the bound is a number of at least 1.
    #[must_use]
    pub fn set_marched_cells(&mut self, marched: &[bool], largest_index: T) -> bool {
        let fits = marched.len() == self.lattice.clearance.len();
        let is_bound = largest_index >= T::one() && largest_index.is_finite();
        if fits && is_bound {
            self.lattice.clearance = flat::distance_to(marched, self.lattice.nodes());
            self.find_uniformity(!marched.contains(&true));
            self.largest_index = largest_index;
        }
        fits && is_bound
    }

    /// Edge length of a voxel [scene unit], the smallest of the three axes.
    pub fn voxel(&self) -> T {
        self.lattice.domain.voxel()
    }
    /// An upper bound of n in this grid, at least 1.
    pub fn largest_index(&self) -> T {
        self.largest_index
    }

    /// World position of a node [scene unit].
    pub fn position(&self, node: usize) -> Vec3<T> {
        self.lattice.position(node)
    }
    /// False for the nodes of the border, whose n is held at 1. True for all nodes of a body with a level set.
    pub fn is_parameter(&self, node: usize) -> bool {
        self.level_set.is_some() || self.lattice.is_inner(node)
    }
    /// The nodes that are parameters, in increasing order.
    pub fn parameters(&self) -> impl Iterator<Item = usize> + use<T> {
        self.lattice.inner(if self.level_set.is_some() { 0 } else { BORDER })
    }

    /// The lattice of nodes; its marked cells are those that are not flat.
    #[inline(always)]
    pub(crate) fn lattice(&self) -> &Lattice<T> {
        &self.lattice
    }
    /// True where the index does not change: in flat cells and outside the box.
    #[inline(always)]
    pub fn is_flat(&self, x: Vec3<T>) -> bool {
        self.lattice.clearance_at(self.lattice.node(x)) != Some(0)
    }
}
