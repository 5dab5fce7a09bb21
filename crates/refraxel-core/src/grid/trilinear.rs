//! Trilinear interpolation over a cell, theory (3.4): the weights of its corners, the gradient, and their transposes.
//!
//! Corner k of a cell lies at +x for bit 0 of k, +y for bit 1, +z for bit 2. `f` ∈ [0, 1]³ is the position in the cell.

use crate::{Real, Vec3, vec3};

/// Weights of the eight corners, theory (3.4), ≥ 0 with the sum 1. They are also the transpose of interpolation: corner k
/// receives `weights(f)[k]` times dLoss/d(value).
#[inline(always)]
pub fn weights<T: Real>(f: Vec3<T>) -> [T; 8] {
    let g = f.map(|v| T::one() - v);
    let yz = [g.y * g.z, f.y * g.z, g.y * f.z, f.y * f.z];
    [g.x * yz[0], f.x * yz[0], g.x * yz[1], f.x * yz[1], g.x * yz[2], f.x * yz[2], g.x * yz[3], f.x * yz[3]]
}

/// Gradient of the interpolated value with respect to the node coordinates [1 / node], from the eight corner values `v`.
/// Not continuous across the faces of cells.
#[inline(always)]
pub fn gradient<T: Real>(f: Vec3<T>, v: &[T; 8]) -> Vec3<T> {
    // Differences of corners along one axis, interpolated along the other two.
    let lerp = |a: T, b: T, t: T| a + (b - a) * t;
    let plane = |a: T, b: T, c: T, d: T, s: T, t: T| lerp(lerp(a, b, s), lerp(c, d, s), t);
    vec3(
        plane(v[1] - v[0], v[3] - v[2], v[5] - v[4], v[7] - v[6], f.y, f.z),
        plane(v[2] - v[0], v[3] - v[1], v[6] - v[4], v[7] - v[5], f.x, f.z),
        plane(v[4] - v[0], v[5] - v[1], v[6] - v[2], v[7] - v[3], f.x, f.y),
    )
}

/// Transpose of [`gradient`] by the corner values: dLoss/dv from dLoss/d(gradient) = `d`.
#[inline(always)]
pub fn gradient_vjp<T: Real>(f: Vec3<T>, d: Vec3<T>) -> [T; 8] {
    let g = f.map(|v| T::one() - v);
    std::array::from_fn(|k| {
        let upper = [k & 1 == 1, k >> 1 & 1 == 1, k >> 2 == 1];
        let w = |a: usize| if upper[a] { f[a] } else { g[a] };
        let along = |a: usize| if upper[a] { d[a] } else { -d[a] };
        along(0) * w(1) * w(2) + along(1) * w(0) * w(2) + along(2) * w(0) * w(1)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [f64; 8] = [0.3, -1.0, 2.0, 0.7, 5.0, -0.2, 1.1, 0.4];

    fn value(f: Vec3<f64>) -> f64 {
        weights(f).iter().zip(CORNERS).map(|(w, v)| w * v).sum()
    }

    #[test]
    fn weights_reproduce_any_trilinear_function() {
        let p = |x: f64, y: f64, z: f64| 1.0 + 2.0 * x - y + 3.0 * z + x * y - 2.0 * y * z + 0.5 * x * y * z;
        let f = vec3(0.2, 0.7, 0.45);
        let at = |k: usize| p((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
        let sum: f64 = weights(f).iter().enumerate().map(|(k, w)| w * at(k)).sum();
        assert!((sum - p(f.x, f.y, f.z)).abs() < 1e-14);
    }

    #[test]
    fn what_corners_receive_is_the_transpose_of_the_gradient() {
        let (f, d) = (vec3(0.2, 0.7, 0.45), vec3(1.0, -0.5, 2.0));
        let back: f64 = gradient_vjp(f, d).iter().zip(CORNERS).map(|(g, v)| g * v).sum();
        assert!((back - gradient(f, &CORNERS).dot(d)).abs() < 1e-14);
    }

    #[test]
    fn gradient_matches_central_differences() {
        let (f, e) = (vec3(0.2, 0.7, 0.45), 1e-6);
        let g = gradient(f, &CORNERS);
        for a in 0..3 {
            let mut s = Vec3::zero();
            s[a] = e;
            assert!(((value(f + s) - value(f - s)) / (2.0 * e) - g[a]).abs() < 1e-8);
        }
    }
}
