//! Real spherical harmonics of degree 0 to 3, theory (3.6): the dependence of colour on the direction.
//!
//! Order within a colour: l = 0; l = 1: −y, z, −x; then l = 2 and l = 3 in the order and with the signs of Plenoxels and
//! Gaussian splatting, so that coefficients can be exchanged with them. The basis is orthonormal on the sphere,
//! ∫ Y_i Y_j dΩ = δ_ij.

use crate::{Real, Vec3, vec3};

/// Number of basis functions at the highest degree, 3.
pub const MAX_BASIS: usize = 16;

/// Y_0 = C0: √(1/4π).
pub const C0: f64 = 0.282_094_791_773_878_14;
/// √(3/4π).
pub const C1: f64 = 0.488_602_511_902_919_9;
/// √(15/4π), √(5/16π), √(15/16π).
pub const C2: [f64; 3] = [1.092_548_430_592_079_2, 0.315_391_565_252_520_05, 0.546_274_215_296_039_6];
/// √(35/32π), √(105/4π), √(21/32π), √(7/16π).
pub const C3: [f64; 4] =
    [0.590_043_589_926_643_5, 2.890_611_442_640_554, 0.457_045_799_464_465_8, 0.373_176_332_590_115_4];
/// Half of C3[1]: the factor of z(x² − y²).
pub const C3_5: f64 = 1.445_305_721_320_277;

/// Degree of the angular dependence of colour: 0 (none) to 3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ShDegree(u8);

impl Default for ShDegree {
    /// Degree 2: 9 coefficients per colour.
    fn default() -> Self {
        Self(2)
    }
}

impl ShDegree {
    /// Degree 3: 16 coefficients per colour.
    pub const MAX: Self = Self(3);

    /// Degree `d` if it is supported (0..=3).
    pub fn new(d: u8) -> Option<Self> {
        (d <= 3).then_some(Self(d))
    }
    /// The degree as a number.
    pub fn get(self) -> u8 {
        self.0
    }
    /// Basis functions per colour, (degree + 1)².
    #[inline(always)]
    pub fn basis(self) -> usize {
        (usize::from(self.0) + 1) * (usize::from(self.0) + 1)
    }
    /// Numbers stored per voxel: three colours × [`Self::basis`], padded to whole vectors of 16 lanes. 16, 16, 32 and 48
    /// for the degrees 0 to 3.
    #[inline(always)]
    pub fn stride(self) -> usize {
        (3 * self.basis()).next_multiple_of(16)
    }
}

/// Values Y_j(d) [1] of all basis functions up to `degree` for a unit direction, theory (3.6); the rest of the array is 0.
///
/// Worked number: Y_0 = 0.2821 for any direction, Y_2(0, 0, 1) = 0.4886.
/// Source: Ramamoorthi and Hanrahan 2001; the constants √((2l+1)/4π · …) have 16 digits.
#[inline]
pub fn basis<T: Real>(degree: ShDegree, d: Vec3<T>) -> [T; MAX_BASIS] {
    let mut y = [T::zero(); MAX_BASIS];
    let c = T::of;
    y[0] = c(C0);
    if degree.0 == 0 {
        return y;
    }
    let (dx, dy, dz) = (d.x, d.y, d.z);
    y[1] = -c(C1) * dy;
    y[2] = c(C1) * dz;
    y[3] = -c(C1) * dx;
    if degree.0 == 1 {
        return y;
    }
    let (xx, yy, zz) = (dx * dx, dy * dy, dz * dz);
    y[4] = c(C2[0]) * dx * dy;
    y[5] = -c(C2[0]) * dy * dz;
    y[6] = c(C2[1]) * (c(2.0) * zz - xx - yy);
    y[7] = -c(C2[0]) * dx * dz;
    y[8] = c(C2[2]) * (xx - yy);
    if degree.0 == 2 {
        return y;
    }
    y[9] = -c(C3[0]) * dy * (c(3.0) * xx - yy);
    y[10] = c(C3[1]) * dx * dy * dz;
    y[11] = -c(C3[2]) * dy * (c(4.0) * zz - xx - yy);
    y[12] = c(C3[3]) * dz * (c(2.0) * zz - c(3.0) * xx - c(3.0) * yy);
    y[13] = -c(C3[2]) * dx * (c(4.0) * zz - xx - yy);
    y[14] = c(C3_5) * dz * (xx - yy);
    y[15] = -c(C3[0]) * dx * (xx - c(3.0) * yy);
    y
}

/// Transpose of the derivative of [`basis`]: Σ_j d_y[j] ∇Y_j, theory (3.14), with Y_j read as polynomials of the free
/// vector d. Project the result on the tangent plane of the sphere to get the derivative along directions.
#[inline]
pub fn basis_vjp<T: Real>(degree: ShDegree, d: Vec3<T>, d_y: &[T; MAX_BASIS]) -> Vec3<T> {
    if degree.0 == 0 {
        return Vec3::zero();
    }
    let c = T::of;
    let (x, y, z) = (d.x, d.y, d.z);
    let two = c(2.0);
    let mut g = vec3(-c(C1) * d_y[3], -c(C1) * d_y[1], c(C1) * d_y[2]);
    if degree.0 >= 2 {
        let [a, b, e] = C2.map(c);
        g += vec3(y, x, T::zero()) * (a * d_y[4]);
        g -= vec3(T::zero(), z, y) * (a * d_y[5]);
        g += vec3(-two * x, -two * y, c(4.0) * z) * (b * d_y[6]);
        g -= vec3(z, T::zero(), x) * (a * d_y[7]);
        g += vec3(two * x, -two * y, T::zero()) * (e * d_y[8]);
    }
    if degree.0 >= 3 {
        let (xx, yy, zz) = (x * x, y * y, z * z);
        let [three, four, six, eight] = [3.0, 4.0, 6.0, 8.0].map(c);
        g -= vec3(six * x * y, three * xx - three * yy, T::zero()) * (c(C3[0]) * d_y[9]);
        g += vec3(y * z, x * z, x * y) * (c(C3[1]) * d_y[10]);
        g -= vec3(-two * x * y, four * zz - xx - three * yy, eight * y * z) * (c(C3[2]) * d_y[11]);
        g += vec3(-six * x * z, -six * y * z, six * zz - three * xx - three * yy) * (c(C3[3]) * d_y[12]);
        g -= vec3(four * zz - three * xx - yy, -two * x * y, eight * x * z) * (c(C3[2]) * d_y[13]);
        g += vec3(two * x * z, -two * y * z, xx - yy) * (c(C3_5) * d_y[14]);
        g -= vec3(three * xx - three * yy, -six * x * y, T::zero()) * (c(C3[0]) * d_y[15]);
    }
    g
}

#[cfg(test)]
mod tests {
    use super::*;

    const DEGREE: ShDegree = ShDegree(3);

    /// Gauss–Legendre in z (8 nodes, exact to degree 15) × 16 equal angles: exact for products up to degree 6.
    fn sphere_integral(f: impl Fn(Vec3<f64>) -> f64) -> f64 {
        let nodes = [
            (0.183_434_642_495_649_8_f64, 0.362_683_783_378_361_96),
            (0.525_532_409_916_329, 0.313_706_645_877_887_3),
            (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
            (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
        ];
        let mut sum = 0.0;
        for (z, w) in nodes.iter().flat_map(|&(z, w)| [(z, w), (-z, w)]) {
            let r = (1.0_f64 - z * z).sqrt();
            for k in 0..16 {
                let a = std::f64::consts::TAU * (k as f64 + 0.3) / 16.0;
                sum += w * f(vec3(r * a.cos(), r * a.sin(), z)) * std::f64::consts::TAU / 16.0;
            }
        }
        sum
    }

    #[test]
    fn the_basis_is_orthonormal_on_the_sphere() {
        for i in 0..MAX_BASIS {
            for j in 0..=i {
                let dot = sphere_integral(|d| {
                    let y = basis(DEGREE, d);
                    y[i] * y[j]
                });
                let want = if i == j { 1.0 } else { 0.0 };
                assert!((dot - want).abs() < 1e-12, "<Y{i}, Y{j}> = {dot}");
            }
        }
    }

    #[test]
    fn the_vjp_matches_central_differences() {
        let (d, e) = (vec3(0.36_f64, -0.48, 0.8), 1e-6);
        for j in 0..MAX_BASIS {
            let mut d_y = [0.0; MAX_BASIS];
            d_y[j] = 1.0;
            let g = basis_vjp(DEGREE, d, &d_y);
            for axis in 0..3 {
                let mut step = Vec3::zero();
                step[axis] = e;
                let fd = (basis(DEGREE, d + step)[j] - basis(DEGREE, d - step)[j]) / (2.0 * e);
                assert!((fd - g[axis]).abs() < 1e-9, "Y{j}, axis {axis}: {fd} vs {}", g[axis]);
            }
        }
    }

    #[test]
    fn lower_degrees_are_prefixes_of_higher_ones() {
        let d = vec3(0.6, 0.0, 0.8);
        let full = basis(DEGREE, d);
        for degree in 0..3 {
            let degree = ShDegree::new(degree).unwrap();
            let y = basis(degree, d);
            assert_eq!(y[..degree.basis()], full[..degree.basis()]);
            assert!(y[degree.basis()..].iter().all(|&v| v == 0.0));
        }
    }
}
