// The transpose of a look-up in a radiance cache, theory (7.8): adds to the gradient of the coefficients, and gives dLoss/d(place,
// direction).

struct LookupAdjoint {
    position: vec3<f32>,
    direction: vec3<f32>,
}

fn radiance_vjp(cache: u32, x: vec3<f32>, d: vec3<f32>, d_light: vec3<f32>) -> LookupAdjoint {
    var s = probe_stencil(cache, x, d);
    // A colour clamped at 0 has no slope.
    let d_radiance = select(vec3<f32>(0.0), d_light, radiance_at(cache, &s) > vec3<f32>(0.0));
    let n = caches[cache].basis;
    var of_probe = array<f32, 8>();
    var d_y = array<f32, MAX_BASIS>();
    for (var k = 0u; k < 2u * bending.taps; k++) {
        let at = probe_of(cache, &s, k);
        let weight = trilinear_weight(s.fraction, k);
        var shown = 0.0;
        for (var j = 0u; j < n; j++) {
            let d_coefficient = vec3<f32>(probes[at + j], probes[at + n + j], probes[at + 2u * n + j]);
            let by_colour = dot(d_radiance, d_coefficient);
            shown += s.basis[j] * by_colour;
            d_y[j] += weight * by_colour;
            let g = weight * s.basis[j] * d_radiance;
            add_probe_gradient(at + j, g.x);
            add_probe_gradient(at + n + j, g.y);
            add_probe_gradient(at + 2u * n + j, g.z);
        }
        of_probe[k] = shown;
    }
    return LookupAdjoint(trilinear_gradient(s.fraction, of_probe) * s.scale, sh_basis_vjp(d, d_y));
}
