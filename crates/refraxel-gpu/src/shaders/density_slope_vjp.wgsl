// Transpose of the gradient of raw density.

// The derivative of the node coordinates along v, the transpose of `node_vjp`.
fn node_jvp(x: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    if (scene.extent == PROJECTIVE) {
        let z = dot(scene.ahead, x - scene.center);
        return rate(x, v) * scene.nodes_per_unit / (z * z);
    }
    let d_u = v * scene.unit_per_world;
    let u = unit(x);
    let m = max_element(abs(u));
    if (scene.extent != CONTRACTED || m <= 1.0) {
        return d_u * scene.nodes_per_unit;
    }
    let inverse = 1.0 / m;
    var axis = vec3<f32>(0.0, 0.0, 1.0);
    if (abs(u.x) == m) {
        axis = vec3<f32>(1.0, 0.0, 0.0);
    } else if (abs(u.y) == m) {
        axis = vec3<f32>(0.0, 1.0, 0.0);
    }
    let slope = sign(dot(axis, u)) * 2.0 * inverse * inverse * (inverse - 1.0);
    return (d_u * (inverse * (2.0 - inverse)) + u * (slope * dot(axis, d_u))) * scene.nodes_per_unit;
}

// Gradient of the weight of one corner of a cell [1 / node].
fn trilinear_slope(f: vec3<f32>, k: u32) -> vec3<f32> {
    let is_upper = vec3<u32>(k & 1u, (k >> 1u) & 1u, k >> 2u) == vec3<u32>(1u);
    let w = select(1.0 - f, f, is_upper);
    let sign = select(vec3<f32>(-1.0), vec3<f32>(1.0), is_upper);
    return sign * vec3<f32>(w.y * w.z, w.x * w.z, w.x * w.y);
}

// What a sample gives to the densities around it, and its gradient, by dLoss/dθ and dLoss/d(∇θ per node).
fn scatter_density(s: ptr<function, Sample>, d_theta: f32, d_node: vec3<f32>) {
    for (var k = 0u; k < 8u; k++) {
        let voxel = corner_of((*s).slot, (*s).local, k);
        if (voxel >= BRICK_VOXELS) {
            add_density_gradient(voxel, trilinear_weight((*s).fraction, k) * d_theta + dot(trilinear_slope((*s).fraction, k), d_node));
            touch(voxel);
        }
    }
}
