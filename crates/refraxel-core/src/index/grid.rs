//! One region of refractive index: coefficients of w on a box.

use super::lattice::Lattice;
use super::stencil::Stencil;
use super::{BORDER, Interpolation, VACUUM, flat, prefilter};
use crate::{Aabb, Domain, Real, Vec3};

/// The index of refraction in one box, theory (2.4): w(x) = Σ_j c_j B_j(x), n = √(2w). Vacuum outside.
///
/// Coefficients lie on `resolution` nodes from face to face, x fastest. All positions are in the world, all derivatives
/// per scene unit. Requires w > 0 everywhere, which c > 0 ensures.
#[derive(Clone, Debug)]
pub struct IndexGrid<T: Copy> {
    /// Its clearance is the distance to the nearest cell that is not flat.
    lattice: Lattice<T>,
    interpolation: Interpolation,
    coefficients: Vec<T>,
    /// Upper bound of n, as of the last [`IndexGrid::find_flat_cells`].
    largest_index: T,
}

impl<T: Real> IndexGrid<T> {
    /// A box of vacuum.
    ///
    /// # Panics
    /// If `resolution` leaves no node between the borders (less than 7 on an axis).
    pub fn vacuum(bounds: Aabb<T>, resolution: [u32; 3], interpolation: Interpolation) -> Self {
        let lattice = Lattice::new(bounds, resolution);
        let coefficients = vec![T::of(VACUUM); lattice.total()];
        Self { lattice, interpolation, coefficients, largest_index: T::one() }
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
    /// False for the nodes of the border, whose n is held at 1.
    pub fn is_parameter(&self, node: usize) -> bool {
        self.lattice.is_inner(node)
    }
    /// The nodes that are parameters, in increasing order.
    pub fn parameters(&self) -> impl Iterator<Item = usize> + use<T> {
        self.lattice.inner(BORDER)
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
    /// outermost cells.
    #[inline(always)]
    fn stencil(&self, x: Vec3<T>) -> Option<([usize; 3], Stencil<T>)> {
        let g = self.lattice.node(x);
        let cell = self.lattice.cell(g)?;
        if self.lattice.is_rim(cell) {
            return None;
        }
        let f = g - Vec3::from(cell.map(|c| T::of(c as f64)));
        Some((cell, Stencil::new(self.interpolation, self.lattice.domain.resolution, cell, f)))
    }

    /// A stencil's share of the parameters: the border has none.
    #[inline(always)]
    fn parameters_of(&self, (cell, stencil): ([usize; 3], Stencil<T>)) -> Stencil<T> {
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
    /// border receives nothing.
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
