//! The radiance cache: spherical harmonics on a coarse grid of probes, theory (7.7).
//!
//! Instead of tracing a mirrored ray, a renderer looks its light up here: one cache look-up reads the eight probes around a
//! point. A [`ProbeStencil`] names these and their weights; forward and transposed look-ups share it.

use crate::grid::trilinear;
use crate::sh::{self, MAX_BASIS, ShDegree};
use crate::{Aabb, Real, Vec3};

/// The radiance that arrives at any point of a box from any direction, coarsely.
///
/// Probes lie on `resolution` nodes from face to face of the box, x fastest; a point outside reads the nearest point of the
/// box. Per probe and colour there are `degree.basis()` coefficients, which run fastest. Coefficients of 0 are mid-grey.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeGrid<T> {
    bounds: Aabb<T>,
    resolution: [u32; 3],
    degree: ShDegree,
    /// SH coefficients [1], `probes × 3 × basis`: the basis runs fastest, then red, green, blue, then the probes.
    pub coefficients: Vec<T>,
}

/// The probes around a point and the basis of a direction: the part of a cache look-up that its transpose shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeStencil<T> {
    /// The corners of the cell, as in [`trilinear`].
    probes: [usize; 8],
    /// Their weights w_k, theory (3.4).
    weights: [T; 8],
    /// Position in the cell, in [0, 1]³.
    fraction: Vec3<T>,
    /// d(fraction)/dx [1 / scene unit]; 0 on axes on which the point lies outside.
    scale: Vec3<T>,
    /// Y_j of the direction.
    basis: [T; MAX_BASIS],
}

impl<T: Real> ProbeGrid<T> {
    /// Mid-grey probes.
    ///
    /// # Panics
    /// If `resolution` is less than 2 on an axis.
    pub fn grey(bounds: Aabb<T>, resolution: [u32; 3], degree: ShDegree) -> Self {
        assert!(resolution.iter().all(|&n| n >= 2), "a probe grid needs two probes per axis");
        let probes: usize = resolution.iter().map(|&n| n as usize).product();
        Self { bounds, resolution, degree, coefficients: vec![T::zero(); probes * 3 * degree.basis()] }
    }

    /// Mid-grey probes at most `spacing` [scene unit] apart.
    pub fn spaced(bounds: Aabb<T>, spacing: T, degree: ShDegree) -> Self {
        let count = |extent: T| ((extent / spacing).ceil().f64() as u32).saturating_add(1).max(2);
        let extent = bounds.extent();
        Self::grey(bounds, [count(extent.x), count(extent.y), count(extent.z)], degree)
    }

    /// The same probes with other coefficients; `None` unless there are as many as needed, all finite.
    pub fn with_coefficients(mut self, coefficients: Vec<T>) -> Option<Self> {
        let fits =
            coefficients.len() == self.coefficients.len() && coefficients.iter().all(|c| c.is_finite());
        self.coefficients = coefficients;
        fits.then_some(self)
    }

    /// The box [scene unit].
    pub fn bounds(&self) -> Aabb<T> {
        self.bounds
    }
    /// Probes per axis.
    pub fn resolution(&self) -> [u32; 3] {
        self.resolution
    }
    /// Degree of the harmonics.
    pub fn degree(&self) -> ShDegree {
        self.degree
    }
    /// Number of probes.
    pub fn probes(&self) -> usize {
        self.coefficients.len() / self.stride()
    }
    /// Coefficients per probe.
    pub fn stride(&self) -> usize {
        3 * self.degree.basis()
    }

    /// World position of a probe [scene unit].
    pub fn position(&self, probe: usize) -> Vec3<T> {
        let [nx, ny, nz] = self.resolution.map(|n| n as usize);
        let at = [(probe % nx, nx), (probe / nx % ny, ny), (probe / nx / ny, nz)];
        let u = Vec3::from(at.map(|(i, n)| T::of(i as f64 / (n - 1) as f64)));
        self.bounds.min + self.bounds.extent().hadamard(u)
    }

    /// The stencil of a cache look-up at `x` [scene unit] in the unit direction of travel `d`.
    #[inline]
    pub fn stencil(&self, x: Vec3<T>, d: Vec3<T>) -> ProbeStencil<T> {
        let (zero, [nx, ny, _]) = (T::zero(), self.resolution.map(|n| n as usize));
        let (mut cell, mut fraction, mut scale) = ([0; 3], Vec3::zero(), Vec3::zero());
        for a in 0..3 {
            let last = T::of(f64::from(self.resolution[a] - 1));
            let per_unit = last / (self.bounds.max[a] - self.bounds.min[a]);
            let g = (x[a] - self.bounds.min[a]) * per_unit;
            let inside = g.max(zero).min(last);
            cell[a] = (inside.f64() as usize).min(self.resolution[a] as usize - 2);
            fraction[a] = inside - T::of(cell[a] as f64);
            scale[a] = if inside == g { per_unit } else { zero };
        }
        let first = cell[0] + nx * (cell[1] + ny * cell[2]);
        ProbeStencil {
            probes: std::array::from_fn(|k| first + (k & 1) + nx * ((k >> 1 & 1) + ny * (k >> 2))),
            weights: trilinear::weights(fraction),
            fraction,
            scale,
            basis: sh::basis(self.degree, d),
        }
    }

    /// Σ_j Y_j k_j + ½ of one probe.
    #[inline(always)]
    fn at_probe(&self, probe: usize, basis: &[T; MAX_BASIS]) -> [T; 3] {
        let n = self.degree.basis();
        let of = &self.coefficients[probe * 3 * n..][..3 * n];
        std::array::from_fn(|c| {
            let k = &of[c * n..][..n];
            T::of(0.5) + k.iter().zip(basis).map(|(&k, &y)| k * y).sum::<T>()
        })
    }

    /// Radiance of a look-up (sRGB-encoded, ≥ 0, 1 = white), theory (7.7).
    #[inline]
    pub fn radiance(&self, s: &ProbeStencil<T>) -> [T; 3] {
        let mut sum = [T::zero(); 3];
        for (&probe, &weight) in s.probes.iter().zip(&s.weights) {
            let of = self.at_probe(probe, &s.basis);
            for c in 0..3 {
                sum[c] += weight * of[c];
            }
        }
        sum.map(|v| v.max(T::zero()))
    }

    /// Transpose of the derivative of [`Self::radiance`], theory (7.8): (dLoss/dx [1 / scene unit], dLoss/dd) of a look-up
    /// in the direction `d`, which counts as a free vector.
    ///
    /// Not differentiable in x on the faces of cells, and where a colour is clamped at 0.
    pub fn radiance_vjp(&self, s: &ProbeStencil<T>, d: Vec3<T>, d_radiance: [T; 3]) -> (Vec3<T>, Vec3<T>) {
        let d_radiance = self.unclamped(s, d_radiance);
        let n = self.degree.basis();
        let (mut of_probe, mut d_basis) = ([T::zero(); 8], [T::zero(); MAX_BASIS]);
        for (k, (&probe, &weight)) in s.probes.iter().zip(&s.weights).enumerate() {
            let shown = self.at_probe(probe, &s.basis);
            for c in 0..3 {
                of_probe[k] += d_radiance[c] * shown[c];
                let coefficients = &self.coefficients[(probe * 3 + c) * n..][..n];
                for (d_y, &coefficient) in d_basis.iter_mut().zip(coefficients) {
                    *d_y += weight * d_radiance[c] * coefficient;
                }
            }
        }
        let d_x = trilinear::gradient(s.fraction, &of_probe).hadamard(s.scale);
        (d_x, sh::basis_vjp(self.degree, d, &d_basis))
    }

    /// Transpose of the derivative of [`Self::radiance`] by the coefficients, theory (7.8): adds to `grad`.
    pub fn scatter(&self, s: &ProbeStencil<T>, d_radiance: [T; 3], grad: &mut [T]) {
        let d_radiance = self.unclamped(s, d_radiance);
        let n = self.degree.basis();
        for (&probe, &weight) in s.probes.iter().zip(&s.weights) {
            for c in 0..3 {
                let of = &mut grad[(probe * 3 + c) * n..][..n];
                for (g, &y) in of.iter_mut().zip(&s.basis) {
                    *g += weight * d_radiance[c] * y;
                }
            }
        }
    }

    /// dLoss/d(radiance) before the clamp: 0 for a colour that is clamped at 0.
    fn unclamped(&self, s: &ProbeStencil<T>, d_radiance: [T; 3]) -> [T; 3] {
        let shown = self.radiance(s);
        std::array::from_fn(|c| if shown[c] > T::zero() { d_radiance[c] } else { T::zero() })
    }

    /// Replaces the coefficients of one probe by those of the radiance that it sees in directions spread evenly over the
    /// sphere, theory (7.9). `seen` yields (unit direction, radiance).
    ///
    /// Error: that of the quadrature, 1e-3 for 4096 directions of [`even_direction`] and radiance of degree 3.
    pub fn project(&mut self, probe: usize, seen: impl ExactSizeIterator<Item = (Vec3<T>, [T; 3])>) {
        let (n, stride) = (self.degree.basis(), self.stride());
        let share = T::of(4.0 * std::f64::consts::PI / seen.len().max(1) as f64);
        let of = &mut self.coefficients[probe * stride..][..stride];
        of.fill(T::zero());
        for (d, radiance) in seen {
            let y = sh::basis(self.degree, d);
            for c in 0..3 {
                let deviation = (radiance[c] - T::of(0.5)) * share;
                of[c * n..][..n].iter_mut().zip(&y).for_each(|(k, &y)| *k += deviation * y);
            }
        }
    }
}

/// Direction `i` of `count` unit directions that are spread evenly over the sphere: a spherical Fibonacci lattice.
///
/// Source: Keinert et al. 2015, "Spherical Fibonacci mapping".
pub fn even_direction<T: Real>(i: usize, count: usize) -> Vec3<T> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
    let (sine, azimuth) = ((1.0 - z * z).sqrt(), std::f64::consts::TAU * (i as f64 * GOLDEN).fract());
    Vec3::from([sine * azimuth.cos(), sine * azimuth.sin(), z].map(T::of))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::tests::Sequence;
    use crate::vec3;

    fn degree(d: u8) -> ShDegree {
        ShDegree::new(d).unwrap()
    }

    fn bounds() -> Aabb<f64> {
        Aabb::new(vec3(-1.0, -0.5, 0.0), vec3(1.0, 0.9, 2.0))
    }

    fn probes(d: u8) -> ProbeGrid<f64> {
        let mut grid = ProbeGrid::grey(bounds(), [4, 3, 5], degree(d));
        let mut r = Sequence(7);
        grid.coefficients.iter_mut().for_each(|c| *c = 0.15 * r.next());
        grid
    }

    #[test]
    fn probes_show_themselves_and_are_joined_linearly() {
        let grid = probes(2);
        let d = vec3(0.36, -0.48, 0.8);
        let (a, b) = (17, 18); // neighbours in x
        let at = |x| grid.radiance(&grid.stencil(x, d));
        let middle = (grid.position(a) + grid.position(b)) * 0.5;
        for c in 0..3 {
            let own = grid.at_probe(a, &sh::basis(grid.degree(), d));
            assert!((at(grid.position(a))[c] - own[c]).abs() < 1e-12);
            let mean = 0.5 * (at(grid.position(a))[c] + at(grid.position(b))[c]);
            assert!((at(middle)[c] - mean).abs() < 1e-12);
        }
        assert_eq!(at(vec3(9.0, 0.1, 1.0)), at(vec3(1.0, 0.1, 1.0)), "outside as on the face");
    }

    #[test]
    fn derivatives_match_central_differences() {
        let (mut r, e) = (Sequence(3), 1e-6);
        for grid in [0, 1, 2, 3].map(probes) {
            for _ in 0..20 {
                let (x, d) = (vec3(0.9 * r.next(), 0.2 + 0.6 * r.next(), 1.0 + 0.9 * r.next()), r.vector());
                let (d, g) = (d.normalized(), [r.next(), r.next(), r.next()]);
                let value = |x, d| {
                    let shown = grid.radiance(&grid.stencil(x, d));
                    (0..3).map(|c| g[c] * shown[c]).sum::<f64>()
                };
                let (d_x, d_d) = grid.radiance_vjp(&grid.stencil(x, d), d, g);
                let (u, v) = (r.vector(), r.vector());
                let fd = (value(x + u * e, d + v * e) - value(x - u * e, d - v * e)) / (2.0 * e);
                assert!((fd - d_x.dot(u) - d_d.dot(v)).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn scattering_is_the_transpose_of_reading() {
        let grid = probes(3);
        let mut r = Sequence(11);
        for _ in 0..20 {
            let s = grid.stencil(r.vector(), r.vector().normalized());
            let mut grad = vec![0.0; grid.coefficients.len()];
            let g = [r.next(), r.next(), r.next()];
            grid.scatter(&s, g, &mut grad);
            // radiance − ½ is linear in the coefficients where it is above 0.
            let forward: f64 =
                grid.radiance(&s).iter().zip(g).filter(|(v, _)| **v > 0.0).map(|(v, g)| g * (v - 0.5)).sum();
            let backward: f64 = grad.iter().zip(&grid.coefficients).map(|(a, b)| a * b).sum();
            assert!((forward - backward).abs() < 1e-12, "{forward} vs {backward}");
        }
    }

    #[test]
    fn projection_returns_what_the_harmonics_can_hold() {
        let truth = probes(3);
        let mut grid = ProbeGrid::grey(bounds(), [4, 3, 5], degree(3));
        let count = 4096;
        let seen = (0..count).map(|i| {
            let d = even_direction(i, count);
            (d, truth.at_probe(9, &sh::basis(degree(3), d)))
        });
        grid.project(9, seen);
        let stride = grid.stride();
        for (a, b) in grid.coefficients[9 * stride..][..stride].iter().zip(&truth.coefficients[9 * stride..])
        {
            assert!((a - b).abs() < 1e-3, "{a} vs {b}");
        }
    }

    #[test]
    fn spacing_is_an_upper_bound() {
        let grid = ProbeGrid::spaced(bounds(), 0.3, degree(1));
        assert_eq!(grid.resolution(), [8, 6, 8]);
        assert!((grid.position(1).x - grid.position(0).x) <= 0.3);
    }
}
