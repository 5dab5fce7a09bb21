// dLoss/d(ray), theory (3.14).

// dLoss/d(start, momentum) of a segment.
struct SegmentAdjoint {
    start: vec3<f32>,
    momentum: vec3<f32>,
}

// The fields are those of `task::RayAdjoint` in Rust.
struct RayGradient {
    origin: vec3<f32>,
    padding_0: f32,
    direction: vec3<f32>,
    padding_1: f32,
    residual: vec3<f32>,
    padding_2: f32,
}

// The adjoint of a sample, and the segment that it lies on.
struct Teaching {
    start: vec3<f32>,
    // Unit direction, in vacuum the momentum.
    unit: vec3<f32>,
    d_theta: f32,
    d_tau: f32,
    d_sample: vec3<f32>,
}

// Σ over the colours of d_sample · (colour that one voxel alone would show).
fn radiance_of(voxel: u32, basis: ptr<function, array<vec4<f32>, BLOCKS>>, d_sample: vec3<f32>) -> f32 {
    var sum = 0.0;
    for (var block = 0u; block < BLOCKS; block++) {
        sum += dot(colour_at(voxel, block) * (*basis)[block], spread(block, d_sample));
    }
    return sum;
}

// Add what one sample gives to its segment.
fn add_segment_adjoint(
    sums: ptr<function, SegmentAdjoint>,
    s: ptr<function, Sample>,
    basis: ptr<function, array<vec4<f32>, BLOCKS>>,
    d: Teaching,
) {
    var theta: array<f32, 8>;
    var radiance: array<f32, 8>;
    for (var k = 0u; k < 8u; k++) {
        let voxel = corner_of((*s).slot, (*s).local, k);
        theta[k] = density[voxel];
        radiance[k] = radiance_of(voxel, basis, d.d_sample);
    }
    let d_node = trilinear_gradient((*s).fraction, theta) * d.d_theta + trilinear_gradient((*s).fraction, radiance);
    let d_x = node_vjp(d.start + d.unit * (*s).t, d_node);
    var d_y = array<f32, MAX_BASIS>();
    for (var block = 0u; block < BLOCKS; block++) {
        let lanes = interpolated(block, (*s).corner, (*s).weight) * spread(block, d.d_sample);
        let lane = 4u * block;
        d_y[lane % BASIS] += lanes.x;
        d_y[(lane + 1u) % BASIS] += lanes.y;
        d_y[(lane + 2u) % BASIS] += lanes.z;
        d_y[(lane + 3u) % BASIS] += lanes.w;
    }
    let d_unit = sh_basis_vjp(d.unit, d_y);
    let tangent = d_unit - d.unit * dot(d.unit, d_unit);
    (*sums).start += d_x;
    (*sums).momentum += d_x * (*s).t + d.unit * (d.d_tau * (*s).tau) + tangent;
}
