//! Making index grids: from functions of position, from one index, from stored coefficients.

use super::index_grid::IndexGrid;
use crate::index::interpolation::Interpolation;
use crate::index::vacuum::{BORDER, VACUUM};
use crate::index::{LevelSet, prefilter};
use crate::{Aabb, Real, Vec3};

impl<T: Real> IndexGrid<T> {
    /// The grid whose n takes the values `index(x)` > 0 at its nodes, except in the border. For the B-spline this solves
    /// for the coefficients, theory (2.8).
    ///
    /// Error: O(h⁴) where n is smooth. It rings beside kinks and jumps; [`Self::from_control_values`] does not.
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_samples(
        bounds: Aabb<T>,
        resolution: [u32; 3],
        interpolation: Interpolation,
        index: impl Fn(Vec3<T>) -> T,
    ) -> Self {
        let mut grid = Self::vacuum(bounds, resolution, interpolation);
        let mut w = grid.deviations(index);
        if interpolation == Interpolation::CubicBSpline {
            prefilter::interpolate(&mut w, resolution.map(|n| n as usize - 2 * BORDER));
        }
        grid.set_deviations(&w);
        grid
    }

    /// The grid whose coefficients are those of `index(x)` > 0 at the nodes. The B-spline then blurs n (variance
    /// 1/3 voxel² per axis) instead of interpolating it.
    ///
    /// Error: O(h²), without ringing. Right for hulls, balls and lenses: a Luneburg lens on 129³ nodes, whose ∇n jumps at
    /// its surface, misses its focus by 4.4e-4 R (median), by 1.2e-3 R with [`Self::from_samples`].
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_control_values(
        bounds: Aabb<T>,
        resolution: [u32; 3],
        interpolation: Interpolation,
        index: impl Fn(Vec3<T>) -> T,
    ) -> Self {
        let mut grid = Self::vacuum(bounds, resolution, interpolation);
        let w = grid.deviations(index);
        grid.set_deviations(&w);
        grid
    }

    /// A body of one `index` > 0: theory (2.23) with constant w inside. Rays are straight between crossings.
    pub fn sharp(level_set: LevelSet<T>, index: T) -> Self {
        let smallest = [2 * BORDER as u32 + 1; 3];
        let mut grid = Self::vacuum(level_set.domain().bounds, smallest, Interpolation::default());
        grid.level_set = Some(level_set);
        grid.set_interior_index(index);
        grid
    }

    /// A body whose index takes the values `index(x)` > 0 at the `resolution` nodes of a grid of its own, from face to face
    /// of the box of the level set. Let `index` continue smoothly beyond the surface, so that the field does not ring there.
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn sharp_from_samples(
        level_set: LevelSet<T>,
        resolution: [u32; 3],
        interpolation: Interpolation,
        index: impl Fn(Vec3<T>) -> T,
    ) -> Self {
        let mut grid = Self::vacuum(level_set.domain().bounds, resolution, interpolation);
        grid.level_set = Some(level_set);
        let w = grid.deviations(index);
        grid.coefficients.iter_mut().zip(w).for_each(|(c, w)| *c = T::of(VACUUM) + w);
        if interpolation == Interpolation::CubicBSpline {
            prefilter::interpolate_all(&mut grid.coefficients, grid.lattice.nodes());
        }
        grid.find_flat_cells(None);
        grid
    }

    /// The same field as the index of a body. All nodes become parameters.
    ///
    /// # Panics
    /// Unless the level set fills the same box.
    #[must_use]
    pub fn with_level_set(mut self, level_set: LevelSet<T>) -> Self {
        assert!(level_set.domain().bounds == self.domain().bounds, "a level set fills the box of its region");
        self.level_set = Some(level_set);
        self
    }

    /// The grid with these coefficients of w [1], one per node, x fastest; `None` unless there is one per node, all finite,
    /// and the border is vacuum.
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_coefficients(
        bounds: Aabb<T>,
        resolution: [u32; 3],
        interpolation: Interpolation,
        coefficients: Vec<T>,
    ) -> Option<Self> {
        let mut grid = Self::vacuum(bounds, resolution, interpolation);
        let is_valid = |node: usize| {
            let c: T = coefficients[node];
            c.is_finite() && (grid.is_parameter(node) || c == T::of(VACUUM))
        };
        if coefficients.len() != grid.coefficients.len() || !(0..coefficients.len()).all(is_valid) {
            return None;
        }
        grid.coefficients = coefficients;
        grid.find_flat_cells(None);
        Some(grid)
    }

    /// w − 1/2 of the index n = `index(x)` at the parameters, in increasing order of nodes.
    fn deviations(&self, index: impl Fn(Vec3<T>) -> T) -> Vec<T> {
        let w = |node| {
            let n = index(self.position(node));
            T::of(0.5) * n * n - T::of(VACUUM)
        };
        self.parameters().map(w).collect()
    }

    /// Sets the parameters to w − 1/2 = `w`, the inverse of [`Self::deviations`].
    fn set_deviations(&mut self, w: &[T]) {
        let nodes: Vec<usize> = self.parameters().collect();
        for (node, &w) in nodes.into_iter().zip(w) {
            self.coefficients[node] = T::of(VACUUM) + w;
        }
        self.find_flat_cells(None);
    }
}
