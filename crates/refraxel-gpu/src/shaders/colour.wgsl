// Colour of theory (3.7). The coefficients of a voxel lie as on the host: BASIS of red, of green, of blue, then padding,
// four lanes to a block. Loops over
// corners are written out: some devices bound the iterations of an invocation.

// SH basis of a direction, repeated for each colour, 0 in the padding.
fn basis_lanes(direction: vec3<f32>) -> array<vec4<f32>, BLOCKS> {
    var y = sh_basis(direction);
    var lanes = array<vec4<f32>, BLOCKS>();
    for (var block = 0u; block < BLOCKS; block++) {
        let lane = 4u * block;
        lanes[block] = vec4<f32>(
            y[lane % BASIS], y[(lane + 1u) % BASIS], y[(lane + 2u) % BASIS], y[(lane + 3u) % BASIS],
        ) * vec4<f32>(channels(block) < vec4<u32>(3u));
    }
    return lanes;
}

// Which colour the lanes of a block belong to; 3 and above for padding.
fn channels(block: u32) -> vec4<u32> {
    return (vec4<u32>(4u * block) + vec4<u32>(0u, 1u, 2u, 3u)) / BASIS;
}

// The values of `by_colour` in the lanes of a block.
fn spread(block: u32, by_colour: vec3<f32>) -> vec4<f32> {
    let colours = channels(block);
    var out = select(vec4<f32>(0.0), vec4<f32>(by_colour.x), colours == vec4<u32>(0u));
    out = select(out, vec4<f32>(by_colour.y), colours == vec4<u32>(1u));
    return select(out, vec4<f32>(by_colour.z), colours == vec4<u32>(2u));
}

// The lanes of a block summed by colour: the transpose of `spread`.
fn gathered(block: u32, lanes: vec4<f32>) -> vec3<f32> {
    let colours = channels(block);
    return vec3<f32>(
        dot(lanes, vec4<f32>(colours == vec4<u32>(0u))),
        dot(lanes, vec4<f32>(colours == vec4<u32>(1u))),
        dot(lanes, vec4<f32>(colours == vec4<u32>(2u))),
    );
}

// A block of interpolated coefficients.
fn interpolated(block: u32, corner: array<u32, 8>, w: array<f32, 8>) -> vec4<f32> {
    return w[0] * colour_at(corner[0], block) + w[1] * colour_at(corner[1], block)
        + w[2] * colour_at(corner[2], block) + w[3] * colour_at(corner[3], block)
        + w[4] * colour_at(corner[4], block) + w[5] * colour_at(corner[5], block)
        + w[6] * colour_at(corner[6], block) + w[7] * colour_at(corner[7], block);
}

// c = max(Σ_j Y_j k_j + ½, 0) at a sample.
fn shade(corner: array<u32, 8>, w: array<f32, 8>, basis: ptr<function, array<vec4<f32>, BLOCKS>>) -> vec3<f32> {
    var sum = vec3<f32>(0.5);
    for (var block = 0u; block < BLOCKS; block++) {
        sum += gathered(block, interpolated(block, corner, w) * (*basis)[block]);
    }
    return max(sum, vec3<f32>(0.0));
}
