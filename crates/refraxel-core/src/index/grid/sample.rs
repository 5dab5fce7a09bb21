//! Evaluating an index grid at a point: w, the force ∇w, and their transposes, theory (2.4)–(2.7) and (2.16).
//!
//! All derivatives are per scene unit: a [`Stencil`] works in node units, and the chain rule multiplies each axis by the
//! nodes per scene unit, `lattice.scale`.

use super::index_grid::IndexGrid;
use crate::index::stencil::Stencil;
use crate::index::vacuum::VACUUM;
use crate::{Real, Vec3};

impl<T: Real> IndexGrid<T> {
    /// The stencil of a point; `None` where the field is vacuum by construction: outside the box and in its outermost
    /// cells. The field of a body is continued there by the polynomial of the next cell.
    #[inline(always)]
    fn stencil(&self, x: Vec3<T>) -> Option<Stencil<T>> {
        let g = self.lattice.node(x);
        let mut cell = self.lattice.cell(g)?;
        if self.lattice.is_rim(cell) {
            self.level_set.as_ref()?;
            let n = self.lattice.nodes();
            cell = std::array::from_fn(|a| cell[a].clamp(1, n[a] - 3));
        }
        let f = g - Vec3::from(cell.map(|c| T::of(c as f64)));
        Some(Stencil::new(self.interpolation, self.lattice.domain.resolution, cell, f))
    }

    /// w = n²/2 [1].
    pub fn w(&self, x: Vec3<T>) -> T {
        self.sample(x).0
    }
    /// The index of refraction n = √(2w) [1].
    pub fn index(&self, x: Vec3<T>) -> T {
        let w = self.w(x);
        (w + w).sqrt()
    }
    /// The force dp/dt = ∇w on a ray [1 / scene unit], theory (2.2).
    pub fn gradient(&self, x: Vec3<T>) -> Vec3<T> {
        self.sample(x).1
    }
    /// (w, ∇w) from one stencil.
    pub fn sample(&self, x: Vec3<T>) -> (T, Vec3<T>) {
        if self.is_constant && self.lattice.cell(self.lattice.node(x)).is_some() {
            return (self.coefficients[0], Vec3::zero());
        }
        let Some(s) = self.stencil(x) else { return (T::of(VACUUM), Vec3::zero()) };
        let (w, g) = s.value_and_force(&self.coefficients);
        (w, g.hadamard(self.lattice.scale))
    }

    /// Transpose of [`Self::sample`] with respect to the coefficients, theory (2.16): adds to `grad`, one per node, given
    /// dLoss/dw and dLoss/d(∇w). The border of a region without level set receives nothing.
    pub fn scatter(&self, x: Vec3<T>, d_w: T, d_gradient: Vec3<T>, grad: &mut [T]) {
        let Some(mut stencil) = self.stencil(x) else { return };
        if self.level_set.is_none() {
            stencil = stencil.without_border(self.lattice.nodes());
        }
        stencil.scatter(d_w, d_gradient.hadamard(self.lattice.scale), grad);
    }

    /// Jᵀv with J = d(∇w)/dx: what the adjoint of a kick adds to that of the position, theory (2.16). Hess(w) v, except for
    /// [`Interpolation::TrilinearOfDifferences`](crate::Interpolation), whose J is not symmetric.
    ///
    /// Not differentiable on cell faces, except for the B-spline.
    pub fn gradient_pullback(&self, x: Vec3<T>, v: Vec3<T>) -> Vec3<T> {
        let Some(s) = self.stencil(x) else { return Vec3::zero() };
        let scale = self.lattice.scale;
        s.force_pullback(&self.coefficients, v.hadamard(scale)).hadamard(scale)
    }

    /// The gradient of w itself [1 / scene unit]: equal to [`Self::gradient`] for all but the interpolation of differences.
    pub fn w_gradient(&self, x: Vec3<T>) -> Vec3<T> {
        let Some(s) = self.stencil(x) else { return Vec3::zero() };
        s.value_gradient(&self.coefficients).hadamard(self.lattice.scale)
    }
}
