// Slopes of the priors, theory (4.4)–(4.6): `priors.rs` of refraxel-core.

fn charbonnier_slope(d: vec4<f32>) -> vec4<f32> {
    return d / sqrt(d * d + TV_EPSILON * TV_EPSILON);
}

fn cauchy_slope(tau: f32) -> f32 {
    return 4.0 * tau / (1.0 + 2.0 * tau * tau);
}

fn opacity_beta_slope(transmittance: f32) -> f32 {
    return 1.0 / (transmittance + OPACITY_MARGIN) - 1.0 / (1.0 - transmittance + OPACITY_MARGIN);
}
