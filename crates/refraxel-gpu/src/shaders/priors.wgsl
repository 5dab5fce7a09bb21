// The slope of a prior, theory (4.4): `priors.rs` of refraxel-core.

fn charbonnier_slope(d: vec4<f32>) -> vec4<f32> {
    return d / sqrt(d * d + TV_EPSILON * TV_EPSILON);
}
