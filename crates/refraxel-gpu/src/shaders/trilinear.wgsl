// Trilinear interpolation over a cell, theory (3.4).

// Weight of one corner.
fn trilinear_weight(f: vec3<f32>, k: u32) -> f32 {
    let is_upper = vec3<u32>(k & 1u, (k >> 1u) & 1u, k >> 2u) == vec3<u32>(1u);
    let w = select(1.0 - f, f, is_upper);
    return w.x * (w.y * w.z);
}

// Weights of the eight corners.
fn trilinear_weights(f: vec3<f32>) -> array<f32, 8> {
    let g = 1.0 - f;
    let yz = vec4<f32>(g.y * g.z, f.y * g.z, g.y * f.z, f.y * f.z);
    return array<f32, 8>(
        g.x * yz.x, f.x * yz.x, g.x * yz.y, f.x * yz.y, g.x * yz.z, f.x * yz.z, g.x * yz.w, f.x * yz.w,
    );
}

fn bilinear(a: f32, b: f32, c: f32, d: f32, s: f32, t: f32) -> f32 {
    return mix(mix(a, b, s), mix(c, d, s), t);
}

// Gradient of the interpolated value [1 / node].
fn trilinear_gradient(f: vec3<f32>, v: array<f32, 8>) -> vec3<f32> {
    return vec3<f32>(
        bilinear(v[1] - v[0], v[3] - v[2], v[5] - v[4], v[7] - v[6], f.y, f.z),
        bilinear(v[2] - v[0], v[3] - v[1], v[6] - v[4], v[7] - v[5], f.x, f.z),
        bilinear(v[4] - v[0], v[5] - v[1], v[6] - v[2], v[7] - v[3], f.x, f.y),
    );
}
