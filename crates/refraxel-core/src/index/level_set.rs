//! The surface of a body: the zero level of a cubic B-spline, theory (2.22).

use super::hull::may_vanish;
use super::lattice::Lattice;
use super::stencil::Stencil;
use super::{BORDER, Interpolation, flat, prefilter};
use crate::{Aabb, Domain, Real, Vec3};

/// A body as φ < 0, theory (2.22): φ(x) = Σ_j c_j B_j(x) [scene unit], best a signed distance.
///
/// Coefficients lie on `resolution` nodes from face to face of a box, x fastest. φ > 0 in the outermost cells and outside:
/// the coefficients of the border (3 layers) are no parameters and are kept at half a voxel or more. A body that
/// reaches them is cut off there. Source of the method: Osher & Fedkiw 2003; spline: theory (2.5).
///
/// ```
/// use refraxel_core::{Aabb, LevelSet, Vec3, vec3};
/// let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
/// let ball = LevelSet::from_samples(cube, [41; 3], |x: Vec3<f64>| x.length() - 0.6);
/// assert!(ball.is_inside(vec3(0.3, 0.3, 0.4)) && !ball.is_inside(vec3(0.4, 0.4, 0.4)));
/// // Interpolation is of fourth order: the surface lies within 1e-4 voxel of the sphere.
/// assert!(ball.value(vec3(0.36, 0.48, 0.0)).abs() < 5e-6);
/// ```
#[derive(Clone, Debug)]
pub struct LevelSet<T: Copy> {
    /// Its clearance is the distance to the nearest cell that may hold the zero level.
    lattice: Lattice<T>,
    coefficients: Vec<T>,
}

/// Least coefficient of the border [voxel].
const BORDER_VALUE: f64 = 0.5;

/// Cells whose φ comes closer to 0 than this [voxel] are searched: covers the rounding of `f32`.
const MARGIN: f64 = 1e-4;

impl<T: Real> LevelSet<T> {
    /// The level set that takes the values `phi(x)` at its nodes, theory (2.8): for distances, whose surface it keeps to
    /// fourth order where the surface is smooth.
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_samples(bounds: Aabb<T>, resolution: [u32; 3], phi: impl Fn(Vec3<T>) -> T) -> Self {
        let Self { lattice, coefficients } = Self::unmarked(bounds, resolution, phi);
        Self::through(lattice, coefficients)
    }

    /// The level set that takes these values at its nodes.
    pub(super) fn through(lattice: Lattice<T>, mut values: Vec<T>) -> Self {
        prefilter::interpolate_all(&mut values, lattice.nodes());
        let mut out = Self { lattice, coefficients: values };
        out.find_surface();
        out
    }

    /// The level set whose coefficients are `phi(x)` at the nodes: φ blurred (variance 1/3 voxel² per axis), which rounds
    /// what is rough. A sphere of radius R [voxel] shrinks by 1/(3R).
    ///
    /// # Panics
    /// If `resolution` has less than 7 nodes on an axis.
    pub fn from_control_values(bounds: Aabb<T>, resolution: [u32; 3], phi: impl Fn(Vec3<T>) -> T) -> Self {
        let mut out = Self::unmarked(bounds, resolution, phi);
        out.find_surface();
        out
    }

    /// The level set with these coefficients; `None` unless there is one per node, all finite.
    pub fn from_coefficients(bounds: Aabb<T>, resolution: [u32; 3], coefficients: Vec<T>) -> Option<Self> {
        let lattice = Lattice::new(bounds, resolution);
        let is_valid = coefficients.len() == lattice.total() && coefficients.iter().all(|c| c.is_finite());
        is_valid.then(|| {
            let mut out = Self { lattice, coefficients };
            out.find_surface();
            out
        })
    }

    fn unmarked(bounds: Aabb<T>, resolution: [u32; 3], phi: impl Fn(Vec3<T>) -> T) -> Self {
        let lattice = Lattice::new(bounds, resolution);
        let coefficients = (0..lattice.total()).map(|j| phi(lattice.position(j))).collect();
        Self { lattice, coefficients }
    }

    /// The same surface in another precision.
    pub fn cast<U: Real>(&self) -> LevelSet<U> {
        let mut out = LevelSet {
            lattice: self.lattice.cast(),
            coefficients: self.coefficients.iter().map(|c| U::of(c.f64())).collect(),
        };
        out.find_surface();
        out
    }

    /// Where the grid lies.
    pub fn domain(&self) -> &Domain<T> {
        &self.lattice.domain
    }
    /// Edge length of a voxel [scene unit], the smallest of the three axes.
    pub fn voxel(&self) -> T {
        self.lattice.domain.voxel()
    }
    /// The coefficients of φ [scene unit], one per node, x fastest.
    pub fn coefficients(&self) -> &[T] {
        &self.coefficients
    }
    /// The coefficients, to be changed. Call [`Self::find_surface`] afterwards: until then rays look for the surface where
    /// it was.
    pub fn coefficients_mut(&mut self) -> &mut [T] {
        &mut self.coefficients
    }

    /// Find again which cells may hold the zero level: those where the control values of φ as a Bézier volume change sign,
    /// within 1e-4 voxel. Lifts the border to half a voxel. Costs about 40 ns per node.
    pub fn find_surface(&mut self) {
        let (n, voxel) = (self.lattice.nodes(), self.voxel());
        let least = T::of(BORDER_VALUE) * voxel;
        for (j, c) in self.coefficients.iter_mut().enumerate() {
            if *c < least && !self.lattice.is_inner(j) {
                *c = least;
            }
        }
        let (c, margin) = (&self.coefficients, T::of(MARGIN) * voxel);
        self.lattice.clearance = flat::distance_to(&may_vanish(c, n, margin), n);
    }

    /// World position of a node.
    pub fn position(&self, node: usize) -> Vec3<T> {
        self.lattice.position(node)
    }
    /// False for the nodes of the border, which stay outside the body.
    pub fn is_parameter(&self, node: usize) -> bool {
        self.lattice.is_inner(node)
    }
    /// The nodes that are parameters, in increasing order.
    pub fn parameters(&self) -> impl Iterator<Item = usize> + use<T> {
        self.lattice.inner(BORDER)
    }
    /// Distance in cells from the cell of `x` to the nearest that may hold the surface; `None` outside the box.
    pub fn clearance(&self, x: Vec3<T>) -> Option<u8> {
        self.lattice.clearance_at(self.lattice.node(x))
    }
    #[inline(always)]
    pub(crate) fn lattice(&self) -> &Lattice<T> {
        &self.lattice
    }

    #[inline(always)]
    fn stencil_at(&self, g: Vec3<T>) -> Option<([usize; 3], Stencil<T>)> {
        let cell = self.lattice.cell(g)?;
        if self.lattice.is_rim(cell) {
            return None;
        }
        let f = g - Vec3::from(cell.map(|c| T::of(c as f64)));
        let resolution = self.lattice.domain.resolution;
        Some((cell, Stencil::new(Interpolation::CubicBSpline, resolution, cell, f)))
    }
    #[inline(always)]
    fn stencil(&self, x: Vec3<T>) -> Option<([usize; 3], Stencil<T>)> {
        self.stencil_at(self.lattice.node(x))
    }

    /// φ and its gradient in node units at node coordinates `g`; a constant outside the spline.
    #[inline(always)]
    pub(crate) fn sample_at(&self, g: Vec3<T>) -> (T, Vec3<T>) {
        match self.stencil_at(g) {
            Some((_, s)) => s.value_and_force(&self.coefficients),
            None => (T::of(BORDER_VALUE) * self.voxel(), Vec3::zero()),
        }
    }

    /// φ [scene unit]; half a voxel outside the spline.
    pub fn value(&self, x: Vec3<T>) -> T {
        self.sample(x).0
    }
    /// φ and ∇φ.
    pub fn sample(&self, x: Vec3<T>) -> (T, Vec3<T>) {
        let (value, gradient) = self.sample_at(self.lattice.node(x));
        (value, gradient.hadamard(self.lattice.scale))
    }
    /// True where φ < 0.
    pub fn is_inside(&self, x: Vec3<T>) -> bool {
        self.value(x) < T::zero()
    }
    /// Hess(φ) v.
    pub fn hessian(&self, x: Vec3<T>, v: Vec3<T>) -> Vec3<T> {
        let Some((_, s)) = self.stencil(x) else { return Vec3::zero() };
        let scale = self.lattice.scale;
        s.value_force_and_pullback(&self.coefficients, v.hadamard(scale)).2.hadamard(scale)
    }
    /// Transpose of [`Self::sample`] with respect to the coefficients: adds to `grad`, one per node. The border receives
    /// nothing.
    pub fn scatter(&self, x: Vec3<T>, d_value: T, d_gradient: Vec3<T>, grad: &mut [T]) {
        if let Some((cell, stencil)) = self.stencil(x) {
            let stencil = stencil.without_border(cell, self.lattice.nodes());
            stencil.scatter(d_value, d_gradient.hadamard(self.lattice.scale), grad);
        }
    }
}
