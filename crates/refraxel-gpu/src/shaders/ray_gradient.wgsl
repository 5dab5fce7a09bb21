// dLoss/d(ray), theory (3.14). Corners are written out: some devices bound the iterations of an invocation.

// dLoss/d(start, momentum) of a segment.
struct SegmentAdjoint {
    start: vec3<f32>,
    momentum: vec3<f32>,
}

// The adjoint of a sample, and the segment that it lies on.
struct Teaching {
    start: vec3<f32>,
    // Unit direction, and |p|: 1 in vacuum.
    unit: vec3<f32>,
    speed: f32,
    d_theta: f32,
    d_tau: f32,
    d_sample: vec3<f32>,
}

// Add what one sample gives to its segment.
fn add_segment_adjoint(
    sums: ptr<function, SegmentAdjoint>,
    s: ptr<function, Sample>,
    basis: ptr<function, array<vec4<f32>, BLOCKS>>,
    d_of: Teaching,
) {
    let corner = (*s).corner;
    let w = (*s).weight;
    let theta = array<f32, 8>(
        density[corner[0]], density[corner[1]], density[corner[2]], density[corner[3]],
        density[corner[4]], density[corner[5]], density[corner[6]], density[corner[7]],
    );
    // What each voxel alone would show, times d_sample.
    var low = vec4<f32>(0.0);
    var high = vec4<f32>(0.0);
    var d_y = array<f32, MAX_BASIS>();
    for (var block = 0u; block < BLOCKS; block++) {
        let d = spread(block, d_of.d_sample);
        let by = d * (*basis)[block];
        let c0 = colour_at(corner[0], block);
        let c1 = colour_at(corner[1], block);
        let c2 = colour_at(corner[2], block);
        let c3 = colour_at(corner[3], block);
        let c4 = colour_at(corner[4], block);
        let c5 = colour_at(corner[5], block);
        let c6 = colour_at(corner[6], block);
        let c7 = colour_at(corner[7], block);
        low += vec4<f32>(dot(c0, by), dot(c1, by), dot(c2, by), dot(c3, by));
        high += vec4<f32>(dot(c4, by), dot(c5, by), dot(c6, by), dot(c7, by));
        let lanes = d * (w[0] * c0 + w[1] * c1 + w[2] * c2 + w[3] * c3 + w[4] * c4 + w[5] * c5 + w[6] * c6 + w[7] * c7);
        let lane = 4u * block;
        d_y[lane % BASIS] += lanes.x;
        d_y[(lane + 1u) % BASIS] += lanes.y;
        d_y[(lane + 2u) % BASIS] += lanes.z;
        d_y[(lane + 3u) % BASIS] += lanes.w;
    }
    let radiance = array<f32, 8>(low.x, low.y, low.z, low.w, high.x, high.y, high.z, high.w);
    let d_node = trilinear_gradient((*s).fraction, theta) * d_of.d_theta + trilinear_gradient((*s).fraction, radiance);
    let d_x = node_vjp(d_of.start + d_of.unit * (d_of.speed * (*s).t), d_node);
    let d_unit = sh_basis_vjp(d_of.unit, d_y);
    let tangent = d_unit - d_of.unit * dot(d_of.unit, d_unit);
    (*sums).start += d_x;
    (*sums).momentum += d_x * (*s).t + (d_of.unit * (d_of.d_tau * (*s).tau) + tangent) / d_of.speed;
}
