//! One evaluation of a grid of coefficients: the 4³ coefficients around a cell and their weights, theory (2.5)–(2.7).
//!
//! All three interpolations are products of one-dimensional weights, so one routine serves them all: it contracts z first,
//! row by row of x, which lie next to each other in memory, then y, and x at the end.

use super::interpolation::Interpolation;
use super::vacuum::BORDER;
use crate::{Real, Vec3, vec3};

/// Coefficients per axis that a cell may depend on: nodes i − 1 … i + 2 of cell i.
pub(super) const TAPS: usize = 4;

/// Weights of the four nodes of one axis at fraction f of the cell, in node units.
///
/// w = Σ V V V c; the force along axis a takes D on that axis and V on the others. For a B-spline D = V′; the trilinear
/// interpolation of node-wise differences has its own D, so that its force is not the gradient of its w.
#[derive(Clone, Copy, Debug)]
struct AxisWeights<T> {
    /// V, which sums to 1.
    value: [T; TAPS],
    /// D, which sums to 0.
    force: [T; TAPS],
    /// dV/df; equal to D for all but the interpolation of differences.
    value_slope: [T; TAPS],
    /// dD/df.
    force_slope: [T; TAPS],
}

impl<T: Real> AxisWeights<T> {
    /// The weights of an interpolation at fraction `f` ∈ [0, 1] of the cell.
    #[inline(always)]
    fn new(interpolation: Interpolation, f: T) -> Self {
        match interpolation {
            Interpolation::CubicBSpline => Self::cubic(f),
            Interpolation::TrilinearOfDifferences => Self::differences(f),
            Interpolation::Trilinear => Self::linear(f),
        }
    }

    /// Uniform cubic B-spline, theory (2.5): C². With g = 1 − f, V = (g³, 4 − 6f² + 3f³, 4 − 6g² + 3g³, f³)/6.
    #[inline(always)]
    fn cubic(f: T) -> Self {
        let (g, half, sixth, two) = (T::one() - f, T::of(0.5), T::of(1.0 / 6.0), T::of(2.0));
        let middle = |f: T| (half * f - T::one()) * f * f + T::of(2.0 / 3.0);
        let slope = |f: T| (T::of(1.5) * f - two) * f;
        let value_slope = [-half * g * g, slope(f), -slope(g), half * f * f];
        Self {
            value: [sixth * g * g * g, middle(f), middle(g), sixth * f * f * f],
            force: value_slope,
            value_slope,
            force_slope: [g, T::of(3.0) * f - two, T::of(3.0) * g - two, f],
        }
    }

    /// Trilinear interpolation of w and, separately, of its central differences at the nodes, theory (2.6).
    #[inline(always)]
    fn differences(f: T) -> Self {
        let (g, h) = (T::one() - f, T::of(0.5));
        Self { force: [-h * g, -h * f, h * g, h * f], force_slope: [h, -h, -h, h], ..Self::linear(f) }
    }

    /// Trilinear, theory (2.7): the force jumps at cell faces and its own slope along the axis is 0.
    #[inline(always)]
    fn linear(f: T) -> Self {
        let (o, one) = (T::zero(), T::one());
        let slope = [o, -one, one, o];
        Self { value: [o, one - f, f, o], force: slope, value_slope: slope, force_slope: [o; TAPS] }
    }
}

/// The coefficients around a point and their weights. All results are in node units, [1 / node] for a gradient.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stencil<T> {
    /// The cell of the point, named by its lowest node.
    cell: [usize; 3],
    /// Index of the lowest of the 4³ coefficients.
    base: usize,
    /// Coefficients per row and per slice of the grid.
    strides: [usize; 2],
    /// D = V′: the force is the gradient of w.
    is_gradient: bool,
    axes: [AxisWeights<T>; 3],
}

impl<T: Real> Stencil<T> {
    /// The stencil of cell `cell` (1 ≤ cell ≤ n − 3 on each axis) at fraction `f`.
    #[inline(always)]
    pub fn new(interpolation: Interpolation, resolution: [u32; 3], cell: [usize; 3], f: Vec3<T>) -> Self {
        let strides = [resolution[0] as usize, (resolution[0] * resolution[1]) as usize];
        let base = (cell[0] - 1) + strides[0] * (cell[1] - 1) + strides[1] * (cell[2] - 1);
        let weights = |f| AxisWeights::new(interpolation, f);
        let axes = [weights(f.x), weights(f.y), weights(f.z)];
        let is_gradient = interpolation != Interpolation::TrilinearOfDifferences;
        Self { cell, base, strides, is_gradient, axes }
    }

    /// The same stencil without the weights of the border, whose coefficients are no parameters. `nodes` is the number of
    /// nodes per axis.
    #[inline(always)]
    pub fn without_border(mut self, nodes: [usize; 3]) -> Self {
        let cell = self.cell;
        if (0..3).all(|a| cell[a] > BORDER && cell[a] + BORDER + 3 <= nodes[a]) {
            return self;
        }
        for axis in 0..3 {
            let is_border = |tap: &usize| !(BORDER..nodes[axis] - BORDER).contains(&(cell[axis] + tap - 1));
            for tap in (0..TAPS).filter(is_border) {
                self.axes[axis].value[tap] = T::zero();
                self.axes[axis].force[tap] = T::zero();
            }
        }
        self
    }

    /// M contractions of the coefficients `c` (x fastest) over z with these weights; each leaves one number per tap of y and
    /// x. One axis after the other: a third of the arithmetic of 4³ products of weights. All taps, also those whose weight is always 0:
    /// loops of a known length are unrolled, and a row is one register.
    #[inline(always)]
    fn along_z<const M: usize>(&self, c: &[T], weights: [&[T; TAPS]; M]) -> [[[T; TAPS]; TAPS]; M] {
        let mut sums = [[[T::zero(); TAPS]; TAPS]; M];
        for k in 0..TAPS {
            for j in 0..TAPS {
                let row: &[T; TAPS] =
                    c[self.base + j * self.strides[0] + k * self.strides[1]..].first_chunk().expect("a row");
                for (sum, w) in sums.iter_mut().zip(weights) {
                    for i in 0..TAPS {
                        sum[j][i] += w[k] * row[i];
                    }
                }
            }
        }
        sums
    }

    /// (w, force) = (Σ V V V c, (Σ D V V c, Σ V D V c, Σ V V D c)).
    #[inline(always)]
    pub fn value_and_force(&self, c: &[T]) -> (T, Vec3<T>) {
        let [x, y, z] = &self.axes;
        let [v, d] = self.along_z(c, [&z.value, &z.force]);
        let [vv, dv] = along_y(&v, [&y.value, &y.force]);
        let [vd] = along_y(&d, [&y.value]);
        (dot(&x.value, &vv), vec3(dot(&x.force, &vv), dot(&x.value, &dv), dot(&x.value, &vd)))
    }

    /// The gradient of w itself; the force for all but the interpolation of differences.
    pub fn value_gradient(&self, c: &[T]) -> Vec3<T> {
        let mut own = *self;
        for axis in &mut own.axes {
            axis.force = axis.value_slope;
        }
        own.value_and_force(c).1
    }

    /// Jᵀu with J = d(force)/dx, the gradient of force · u: the Hessian times u where the force is a gradient.
    #[inline(always)]
    pub fn force_pullback(&self, c: &[T], u: Vec3<T>) -> Vec3<T> {
        let [x, y, z] = &self.axes;
        // Two letters: the weights of y and of z; V, D, S = dV/df, T = dD/df.
        let [v, d, t] = self.along_z(c, [&z.value, &z.force, &z.force_slope]);
        let [vv, dv, tv] = along_y(&v, [&y.value, &y.force, &y.force_slope]);
        let [vd, sd] = along_y(&d, [&y.value, &y.value_slope]);
        let [vt] = along_y(&t, [&y.value]);
        let (sv, [vs, ds]) = if self.is_gradient {
            (dv, [vd, sd])
        } else {
            let [s] = self.along_z(c, [&z.value_slope]);
            (along_y(&v, [&y.value_slope])[0], along_y(&s, [&y.value, &y.force]))
        };
        let (mut by_y, mut by_z) = ([T::zero(); TAPS], [T::zero(); TAPS]);
        for i in 0..TAPS {
            by_y[i] = u.y * tv[i] + u.z * sd[i];
            by_z[i] = u.z * vt[i] + u.y * ds[i];
        }
        let across = u.y * dot(&x.value_slope, &dv) + u.z * dot(&x.value_slope, &vd);
        vec3(
            u.x * dot(&x.force_slope, &vv) + across,
            dot(&x.value, &by_y) + u.x * dot(&x.force, &sv),
            dot(&x.value, &by_z) + u.x * dot(&x.force, &vs),
        )
    }

    /// Transpose of [`Self::value_and_force`] with respect to the coefficients: adds to `grad`, laid out as they are.
    #[inline(always)]
    pub fn scatter(&self, d_value: T, d_force: Vec3<T>, grad: &mut [T]) {
        let [x, y, z] = &self.axes;
        for k in 0..TAPS {
            // forward: w = Σ V V V c, force = (Σ D V V c, Σ V D V c, Σ V V D c)
            let (of_value, of_slope) =
                (d_value * z.value[k] + d_force.z * z.force[k], d_force.y * z.value[k]);
            let of_force = d_force.x * z.value[k];
            for j in 0..TAPS {
                let by_value = y.value[j] * of_value + y.force[j] * of_slope;
                let by_force = y.value[j] * of_force;
                let row = &mut grad[self.base + j * self.strides[0] + k * self.strides[1]..][..TAPS];
                for i in 0..TAPS {
                    row[i] += x.value[i] * by_value + x.force[i] * by_force;
                }
            }
        }
    }
}

/// M contractions over y of what a contraction over z has left; each leaves one number per tap of x.
#[inline(always)]
fn along_y<T: Real, const M: usize>(of: &[[T; TAPS]; TAPS], weights: [&[T; TAPS]; M]) -> [[T; TAPS]; M] {
    let mut sums = [[T::zero(); TAPS]; M];
    for j in 0..TAPS {
        for (sum, w) in sums.iter_mut().zip(weights) {
            for i in 0..TAPS {
                sum[i] += w[j] * of[j][i];
            }
        }
    }
    sums
}

/// Σ a_i b_i, summed in pairs.
#[inline(always)]
fn dot<T: Real>(a: &[T; TAPS], b: &[T; TAPS]) -> T {
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3])
}
