//! One region of refractive index: coefficients of w on a box.

use super::lattice::Lattice;
use super::stencil::Stencil;
use super::{BORDER, Interpolation, LevelSet, VACUUM, flat, prefilter};
use crate::{Aabb, Domain, Real, Vec3};

/// The index of refraction in one box, theory (2.4): w(x) = Σ_j c_j B_j(x), n = √(2w). Vacuum outside.
///
/// Coefficients lie on `resolution` nodes from face to face, x fastest. All positions are in the world, all derivatives
/// per scene unit. Requires w > 0 everywhere, which c > 0 ensures.
///
/// With a [`LevelSet`] the field is the index of the body where φ < 0, and n = 1 where φ > 0, theory (2.23). Its functions
/// of x still return the field of the body, wherever x is; [`Medium`](super::Medium) asks which side rules. The border is
/// free then, for it lies outside the body.
#[derive(Clone, Debug)]
pub struct IndexGrid<T: Copy> {
    /// Its clearance is the distance to the nearest cell that is not flat.
    lattice: Lattice<T>,
    interpolation: Interpolation,
    coefficients: Vec<T>,
    /// Upper bound of n, as of the last [`IndexGrid::find_flat_cells`].
    largest_index: T,
    /// True where all cells are flat and none is free.
    is_uniform: bool,
    level_set: Option<LevelSet<T>>,
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
            level_set: None,
        }
    }

    /// The grid whose n takes the values `index(x)` > 0 at its nodes, except in the border. For the B-spline this solves
    /// for the coefficients, theory (2.8): fourth-order accurate where n is smooth, but it rings beside kinks and jumps.
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

    /// The grid whose coefficients are those of `index(x)` > 0 at the nodes. The B-spline then is n blurred (variance
    /// 1/3 voxel² per axis) instead of interpolated: second order, without ringing. Right for hulls, balls and lenses: a
    /// Luneburg lens of 129³ nodes, whose ∇n jumps at its surface, misses its focus by 4.4e-4 R (median), by 1.2e-3 R with
    /// [`Self::from_samples`].
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
    /// of the box of the level set: let `index` continue smoothly beyond the surface.
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

    /// The surface, if this is a body with one.
    pub fn level_set(&self) -> Option<&LevelSet<T>> {
        self.level_set.as_ref()
    }
    /// The surface, to be changed. Call [`LevelSet::find_surface`] afterwards.
    pub fn level_set_mut(&mut self) -> Option<&mut LevelSet<T>> {
        self.level_set.as_mut()
    }
    /// The index, if it is one number (w differs by less than [`super::FLAT`]).
    pub fn interior_index(&self) -> Option<T> {
        self.is_uniform.then(|| (self.coefficients[0] + self.coefficients[0]).sqrt())
    }
    /// True where rays are straight all through the box.
    #[inline(always)]
    pub(crate) fn is_uniform(&self) -> bool {
        self.is_uniform
    }
    /// Give the body one index > 0. By dw = n dn the derivative with respect to it is n times the sum of those with respect
    /// to the coefficients.
    ///
    /// # Panics
    /// Without a level set, where the border is vacuum.
    pub fn set_interior_index(&mut self, index: T) {
        assert!(self.level_set.is_some(), "only a body with a surface has one index");
        self.coefficients.fill(T::of(0.5) * index * index);
        self.find_flat_cells(None);
    }

    /// w − 1/2 of `index` at the parameters.
    fn deviations(&self, index: impl Fn(Vec3<T>) -> T) -> Vec<T> {
        let w = |node| {
            let n = index(self.position(node));
            T::of(0.5) * n * n - T::of(VACUUM)
        };
        self.parameters().map(w).collect()
    }

    fn set_deviations(&mut self, w: &[T]) {
        let nodes: Vec<usize> = self.parameters().collect();
        for (node, &w) in nodes.into_iter().zip(w) {
            self.coefficients[node] = T::of(VACUUM) + w;
        }
        self.find_flat_cells(None);
    }

    /// The grid with these coefficients of w; `None` unless there is one per node, all finite, and the border is vacuum.
    pub fn from_coefficients(
        bounds: Aabb<T>,
        resolution: [u32; 3],
        interpolation: Interpolation,
        coefficients: Vec<T>,
    ) -> Option<Self> {
        let mut grid = Self::vacuum(bounds, resolution, interpolation);
        let is_valid =
            |(node, &c): (usize, &T)| c.is_finite() && (grid.is_parameter(node) || c == T::of(VACUUM));
        if coefficients.len() != grid.coefficients.len() || !coefficients.iter().enumerate().all(is_valid) {
            return None;
        }
        grid.coefficients = coefficients;
        grid.find_flat_cells(None);
        Some(grid)
    }

    /// The same field in another precision.
    pub fn cast<U: Real>(&self) -> IndexGrid<U> {
        IndexGrid {
            lattice: self.lattice.cast(),
            interpolation: self.interpolation,
            coefficients: self.coefficients.iter().map(|c| U::of(c.f64())).collect(),
            largest_index: U::of(self.largest_index.f64()),
            is_uniform: self.is_uniform,
            level_set: self.level_set.as_ref().map(LevelSet::cast),
        }
    }

    /// Where the grid lies.
    pub fn domain(&self) -> &Domain<T> {
        &self.lattice.domain
    }
    /// How it is interpolated.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }
    /// The coefficients of w, one per node, x fastest.
    pub fn coefficients(&self) -> &[T] {
        &self.coefficients
    }
    /// The coefficients, to be changed. Leave the border as it is ([`Self::is_parameter`]), and call
    /// [`Self::find_flat_cells`] afterwards: until then rays still hop where the field used to be flat.
    pub fn coefficients_mut(&mut self) -> &mut [T] {
        &mut self.coefficients
    }

    /// Find again which cells are flat (differences ≤ [`flat::FLAT`]): rays cross them in one hop, so that coefficients
    /// inside a flat region get no gradient. `free`, one per node, names coefficients that shall get theirs: cells that
    /// depend on one of them are marched even if flat. [`Self::from_samples`] leaves ripples beside an edge that take about
    /// 10 voxels to fade; [`Self::from_control_values`] is flat 2 voxels away.
    pub fn find_flat_cells(&mut self, free: Option<&[bool]>) {
        self.lattice.clearance = flat::clearance(&self.coefficients, self.lattice.nodes(), free);
        self.is_uniform = self.lattice.clearance.iter().all(|&d| d == flat::FAR);
        let largest = self.coefficients.iter().copied().fold(T::of(VACUUM), T::max);
        self.largest_index = (largest + largest).sqrt();
    }

    /// Edge length of a voxel [scene unit], the smallest of the three axes.
    pub fn voxel(&self) -> T {
        self.lattice.domain.voxel()
    }
    /// An upper bound of n in this grid.
    pub fn largest_index(&self) -> T {
        self.largest_index
    }

    /// World position of a node.
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

    /// Where it lies, and which of its cells are not flat.
    #[inline(always)]
    pub(crate) fn lattice(&self) -> &Lattice<T> {
        &self.lattice
    }
    /// True where the index does not change: in flat cells and outside the box.
    #[inline(always)]
    pub fn is_flat(&self, x: Vec3<T>) -> bool {
        self.lattice.clearance_at(self.lattice.node(x)) != Some(0)
    }

    /// The cell of a point and its stencil; `None` where the field is vacuum by construction: outside and in the
    /// outermost cells. The field of a body is continued there by the polynomial of the next cell.
    #[inline(always)]
    fn stencil(&self, x: Vec3<T>) -> Option<([usize; 3], Stencil<T>)> {
        let g = self.lattice.node(x);
        let mut cell = self.lattice.cell(g)?;
        if self.lattice.is_rim(cell) {
            self.level_set.as_ref()?;
            let n = self.lattice.nodes();
            cell = std::array::from_fn(|a| cell[a].clamp(1, n[a] - 3));
        }
        let f = g - Vec3::from(cell.map(|c| T::of(c as f64)));
        Some((cell, Stencil::new(self.interpolation, self.lattice.domain.resolution, cell, f)))
    }

    /// A stencil's share of the parameters: the border has none, except in a body.
    #[inline(always)]
    fn parameters_of(&self, (cell, stencil): ([usize; 3], Stencil<T>)) -> Stencil<T> {
        if self.level_set.is_some() {
            return stencil;
        }
        stencil.without_border(cell, self.lattice.nodes())
    }

    /// w = n²/2.
    pub fn w(&self, x: Vec3<T>) -> T {
        self.sample(x).0
    }
    /// The index of refraction n = √(2w).
    pub fn index(&self, x: Vec3<T>) -> T {
        let w = self.w(x);
        (w + w).sqrt()
    }
    /// The force dp/dt = ∇w on a ray.
    pub fn gradient(&self, x: Vec3<T>) -> Vec3<T> {
        self.sample(x).1
    }
    /// w and ∇w from one stencil.
    pub fn sample(&self, x: Vec3<T>) -> (T, Vec3<T>) {
        let Some((_, s)) = self.stencil(x) else { return (T::of(VACUUM), Vec3::zero()) };
        let (w, g) = s.value_and_force(&self.coefficients);
        (w, g.hadamard(self.lattice.scale))
    }

    /// w, ∇w and Jᵀv from one stencil, with J = d(∇w)/dx: Hess(w) v, except for differences, whose J is not symmetric.
    pub fn sample_with_hessian(&self, x: Vec3<T>, v: Vec3<T>) -> (T, Vec3<T>, Vec3<T>) {
        let Some((_, s)) = self.stencil(x) else { return (T::of(VACUUM), Vec3::zero(), Vec3::zero()) };
        let (w, g, jv) = s.value_force_and_pullback(&self.coefficients, v.hadamard(self.lattice.scale));
        (w, g.hadamard(self.lattice.scale), jv.hadamard(self.lattice.scale))
    }

    /// Transpose of [`Self::sample`] with respect to the coefficients, theory (2.16): adds to `grad`, one per node. The
    /// border of a region without level set receives nothing.
    pub fn scatter(&self, x: Vec3<T>, d_w: T, d_gradient: Vec3<T>, grad: &mut [T]) {
        if let Some(found) = self.stencil(x) {
            self.parameters_of(found).scatter(d_w, d_gradient.hadamard(self.lattice.scale), grad);
        }
    }

    /// (∇w, Jᵀv) at a point, J = d(∇w)/dx: what the adjoint of a kick does to the position, theory (2.16).
    /// Not differentiable on cell faces, except for the B-spline.
    pub fn gradient_pullback(&self, x: Vec3<T>, v: Vec3<T>) -> (Vec3<T>, Vec3<T>) {
        let (_, g, d_x) = self.sample_with_hessian(x, v);
        (g, d_x)
    }

    /// The gradient of w itself: the force for all but the interpolation of differences.
    pub fn w_gradient(&self, x: Vec3<T>) -> Vec3<T> {
        let Some((_, s)) = self.stencil(x) else { return Vec3::zero() };
        s.value_gradient(&self.coefficients).hadamard(self.lattice.scale)
    }
}
