// RMSProp on the touched voxels, one brick per workgroup. Gradients are zero again afterwards.

@compute @workgroup_size(WORKGROUP)
fn update(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let voxel = invocation(group, groups, lane);
    if (voxel < BRICK_VOXELS || voxel >= scene.slots * BRICK_VOXELS) {
        return;
    }
    // Written by this dispatch is STATUS_PARAMETER alone.
    if (((touched[voxel >> 5u] >> (voxel & 31u)) & 1u) == 0u || has_failed()) {
        return;
    }
    let g = take_density_gradient(voxel);
    let step = rms_prop(g * g, density_moment[voxel], task.rate_density);
    density_moment[voxel] = step.moment;
    density[voxel] += g * step.factor;
    let finite_colour = update_colour(voxel);
    if (!finite_colour || !is_finite(density[voxel])) {
        atomicOr(&status[STATUS_PARAMETER], 1u);
    }
}

fn has_failed() -> bool {
    return (atomicLoad(&status[STATUS_FAILED]) | atomicLoad(&status[STATUS_LOSS])) != 0u;
}

// One second moment serves all channels of a voxel: the mean square of their gradients.
fn update_colour(voxel: u32) -> bool {
    var g = array<vec4<f32>, BLOCKS>();
    var square = 0.0;
    for (var block = 0u; block < BLOCKS; block++) {
        g[block] = take_colour_gradient(voxel, block);
        square += dot(g[block], g[block]);
    }
    let step = rms_prop(square / f32(3u * BASIS), colour_moment[voxel], task.rate_colour);
    colour_moment[voxel] = step.moment;
    var finite = true;
    for (var block = 0u; block < BLOCKS; block++) {
        let of_view = (vec4<u32>(4u * block) + vec4<u32>(0u, 1u, 2u, 3u)) % BASIS != vec4<u32>(0u);
        let share = select(vec4<f32>(1.0), vec4<f32>(task.rate_view), of_view);
        let c = colour_at(voxel, block) + g[block] * share * step.factor;
        set_colour(voxel, block, c);
        finite &= is_finite(c.x) && is_finite(c.y) && is_finite(c.z) && is_finite(c.w);
    }
    return finite;
}
