//! Transcendentals of the density, sixteen samples at a time.

use fearless_simd::{f32x16, prelude::*};

/// eˣ for x ≤ 0 (values below −87 give 0 within rounding). Relative error < 3e-7: range reduction by ln 2 in two parts,
/// degree-6 polynomial on |r| ≤ ½ ln 2 (Cody and Waite).
#[inline(always)]
pub(super) fn exp<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    let x = x.max(f32x16::splat(simd, -87.0));
    let n = (x * std::f32::consts::LOG2_E).round_ties_even();
    let r = n.mul_add(f32x16::splat(simd, -0.693_359_4), x);
    let r = n.mul_add(f32x16::splat(simd, 2.121_944_4e-4), r);
    let mut p = f32x16::splat(simd, 1.0 / 720.0);
    for k in [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        p = p.mul_add(r, f32x16::splat(simd, k));
    }
    let exponent = simd.cvt_i32_f32x16(n) + fearless_simd::i32x16::splat(simd, 127);
    p * (exponent << 23).bitcast::<f32x16<S>>()
}

/// Optical depth and its slope, theory (3.5) and (3.9), for raw densities θ over `scale_length` = density scale × ds:
/// (τ, dτ/dθ, 1 − e^(−τ)).
#[inline(always)]
pub(super) fn absorb<S: Simd>(simd: S, theta: &[f32; 16], scale_length: &[f32; 16]) -> [[f32; 16]; 3] {
    let one = f32x16::splat(simd, 1.0);
    let theta = f32x16::from_slice(simd, theta);
    let k = f32x16::from_slice(simd, scale_length);
    let u = exp(simd, -theta.abs());
    // ln(1 + u) = 2 artanh(s), s = u / (2 + u) ≤ 1/3; truncated after s¹¹: error 1e-7.
    let s = u / (u + 2.0);
    let s2 = s * s;
    let mut p = f32x16::splat(simd, 2.0 / 11.0);
    for c in [2.0 / 9.0, 2.0 / 7.0, 2.0 / 5.0, 2.0 / 3.0, 2.0] {
        p = p.mul_add(s2, f32x16::splat(simd, c));
    }
    let softplus = p.mul_add(s, theta.max(f32x16::splat(simd, 0.0)));
    let inverse = one / (one + u);
    let logistic = simd.select_f32x16(theta.simd_ge(0.0), inverse, u * inverse);
    let tau = k * softplus;
    let alpha = one - exp(simd, -tau);
    // 1 − e^(−τ) cancels for small τ: τ (1 − τ/2 + τ²/6) is exact to 1e-7 below 0.02.
    let series = tau * (tau * tau).mul_add(f32x16::splat(simd, 1.0 / 6.0), one - tau * 0.5);
    let alpha = simd.select_f32x16(tau.simd_lt(0.02), series, alpha);
    let mut out = [[0.0; 16]; 3];
    tau.store_slice(&mut out[0]);
    (k * logistic).store_slice(&mut out[1]);
    alpha.store_slice(&mut out[2]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use fearless_simd::{Level, dispatch};

    #[test]
    fn absorption_agrees_with_double_precision() {
        let (mut worst_tau, mut worst_slope, mut worst_alpha) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..400 {
            let theta = std::array::from_fn(|l| -12.0 + 0.07 * k as f32 + 0.004 * l as f32);
            let scale = [0.6_f32; 16];
            let [tau, slope, alpha] = dispatch!(Level::new(), simd => absorb(simd, &theta, &scale));
            for l in 0..16 {
                let (t, s) = (f64::from(theta[l]), f64::from(scale[l]));
                let tau64 = s * t.exp().ln_1p();
                let rel = |a: f32, b: f64| (f64::from(a) - b).abs() / b.abs();
                worst_tau = worst_tau.max(rel(tau[l], tau64));
                worst_slope = worst_slope.max(rel(slope[l], s / (1.0 + (-t).exp())));
                worst_alpha = worst_alpha.max(rel(alpha[l], -(-tau64).exp_m1()));
            }
        }
        // A few units in the last place of f32, 6e-8 each.
        assert!(worst_tau < 1e-6 && worst_slope < 1e-6, "tau {worst_tau:e}, slope {worst_slope:e}");
        assert!(worst_alpha < 4e-6, "alpha {worst_alpha:e}");
    }
}
