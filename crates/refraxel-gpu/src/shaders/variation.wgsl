// The gradient of total variation, theory (4.3), of the buckets of bricks whose turn it is.

@compute @workgroup_size(WORKGROUP)
fn variation(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let voxel = invocation(group, groups, lane);
    let slot = voxel / BRICK_VOXELS;
    if (slot == 0u || slot >= scene.slots) {
        return;
    }
    let period = max(task.tv_period, 1u);
    if ((slot / BUCKET_SLOTS + task.tv_turn) % period != 0u) {
        return;
    }
    let brick = vec3<u32>(brick_of_slot[3u * slot], brick_of_slot[3u * slot + 1u], brick_of_slot[3u * slot + 2u]);
    let local = vec3<u32>(voxel & 3u, (voxel >> 2u) & 3u, (voxel >> 4u) & 3u);
    var has_neighbour = false;
    var d_density = 0.0;
    // Below along x, above along x, below along y …
    for (var k = 0u; k < 6u; k++) {
        let other = neighbour(slot, brick, local, k >> 1u, (k & 1u) == 1u);
        if (other != 0u) {
            has_neighbour = true;
            d_density += charbonnier_slope(vec4<f32>(density[voxel] - density[other])).x;
            if (task.tv_colour > 0.0) {
                add_colour_variation(voxel, other);
            }
        }
    }
    if (has_neighbour) {
        add_density_gradient(voxel, f32(task.tv_period) * task.tv_density * d_density);
        touch(voxel);
    }
}

fn add_colour_variation(voxel: u32, other: u32) {
    for (var block = 0u; block < BLOCKS; block++) {
        let slope = charbonnier_slope(colour_at(voxel, block) - colour_at(other, block));
        add_colour_gradient(voxel, block, f32(task.tv_period) * task.tv_colour * slope);
    }
}

// The next stored voxel along an axis; 0 where there is none. A neighbour in an absent brick does not count.
fn neighbour(slot: u32, brick: vec3<u32>, local: vec3<u32>, axis: u32, above: bool) -> u32 {
    let stride = 1u << (2u * axis);
    let at = local.x + 4u * local.y + 16u * local.z;
    if (above && local[axis] < 3u) {
        return slot * BRICK_VOXELS + at + stride;
    }
    if (!above && local[axis] > 0u) {
        return slot * BRICK_VOXELS + at - stride;
    }
    var next = brick;
    if (above) {
        next[axis] += 1u;
    } else {
        next[axis] -= 1u;
    }
    // Below 0 wraps round to numbers beyond the grid.
    if (any(next >= scene.bricks)) {
        return 0u;
    }
    let entry = table[dot(next, scene.brick_strides)];
    if (entry <= 0) {
        return 0u;
    }
    let there = select(at + 3u * stride, at - 3u * stride, above);
    return u32(entry) * BRICK_VOXELS + there;
}
