// Slopes of the priors, theory (4.4) and (4.6): `priors.rs` of refraxel-core.

fn charbonnier_slope(d: vec4<f32>) -> vec4<f32> {
    return d / sqrt(d * d + TV_EPSILON * TV_EPSILON);
}

fn opacity_beta_slope(transmittance: f32) -> f32 {
    return 1.0 / (transmittance + OPACITY_MARGIN) - 1.0 / (1.0 - transmittance + OPACITY_MARGIN);
}
