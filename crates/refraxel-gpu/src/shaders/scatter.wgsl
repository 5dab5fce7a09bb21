// What samples give to voxels, and exit rays to texels.

// dLoss/d(texels), given dLoss/d(radiance).
fn scatter_background(direction: vec3<f32>, d_radiance: vec3<f32>) {
    if (scene.rows == 0u) {
        return;
    }
    let cell = texel_cell(direction);
    let w = texel_weights(cell.fraction);
    for (var k = 0u; k < 4u; k++) {
        let d = w[k] * d_radiance;
        add_texel_gradient(3u * cell.index[k], d.x);
        add_texel_gradient(3u * cell.index[k] + 1u, d.y);
        add_texel_gradient(3u * cell.index[k] + 2u, d.z);
    }
}

// What a sample gives to the voxels around it, theory (3.13). The empty brick never learns. These loops are not written out but for
// pairs of corners: software adapters would compile so many atomics for minutes, and they bound the iterations of an invocation.
fn scatter(
    s: ptr<function, Sample>,
    basis: ptr<function, array<vec4<f32>, BLOCKS>>,
    d_theta: f32,
    d_sample: vec3<f32>,
) {
    for (var k = 0u; k < 4u; k++) {
        let low = corner_of((*s).slot, (*s).local, 2u * k);
        let high = corner_of((*s).slot, (*s).local, 2u * k + 1u);
        let weight = vec2<f32>(trilinear_weight((*s).fraction, 2u * k), trilinear_weight((*s).fraction, 2u * k + 1u));
        let learns = vec2<bool>(low >= BRICK_VOXELS, high >= BRICK_VOXELS);
        if (learns.x) {
            add_density_gradient(low, weight.x * d_theta);
            touch(low);
        }
        if (learns.y) {
            add_density_gradient(high, weight.y * d_theta);
            touch(high);
        }
        for (var block = 0u; block < BLOCKS; block++) {
            let d = spread(block, d_sample) * (*basis)[block];
            if (learns.x) {
                add_colour_gradient(low, block, weight.x * d);
            }
            if (learns.y) {
                add_colour_gradient(high, block, weight.y * d);
            }
        }
    }
}
