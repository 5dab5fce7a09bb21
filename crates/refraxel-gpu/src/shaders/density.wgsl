// The density of theory (3.5) and the opacity of theory (3.9), accurate to a few units in the last place on any device:
// the logarithm of a device may be wrong by 2⁻²¹ near 1, and 1 − eˣ cancels.

// ln(1 + u) for u in [0, 1]: 2 artanh(s), s = u / (2 + u) ≤ 1/3, truncated after s¹⁵: error 1e-9.
fn ln_1p(u: f32) -> f32 {
    let s = u / (2.0 + u);
    let q = s * s;
    let p = 2.0 / 3.0 + q * (2.0 / 5.0 + q * (2.0 / 7.0 + q * (2.0 / 9.0 + q * (2.0 / 11.0 + q * (2.0 / 13.0 + q * (2.0 / 15.0))))));
    return s * (2.0 + q * p);
}

// ln(1 + eˣ).
fn softplus(x: f32) -> f32 {
    return max(x, 0.0) + ln_1p(exp(-abs(x)));
}

// The derivative of softplus.
fn logistic(x: f32) -> f32 {
    let e = exp(-abs(x));
    return select(e, 1.0, x >= 0.0) / (1.0 + e);
}

// 1 − e^(−τ), τ ≥ 0. Below ¼ by its series up to τ⁷: error 1e-9.
fn opacity_of(tau: f32) -> f32 {
    if (tau > 0.25) {
        return 1.0 - exp(-tau);
    }
    return tau * (1.0 - tau / 2.0 * (1.0 - tau / 3.0 * (1.0 - tau / 4.0 * (1.0 - tau / 5.0 * (1.0 - tau / 6.0 * (1.0 - tau / 7.0))))));
}
