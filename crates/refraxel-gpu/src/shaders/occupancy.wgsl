// Which cells may hold a sample above the cut-off: those with a corner above it. One invocation per word of 32 cells.

@compute @workgroup_size(WORKGROUP)
fn occupancy(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let word = invocation(group, groups, lane);
    let slot = word / 2u;
    if (slot == 0u || slot >= scene.slots) {
        return;
    }
    var bits = 0u;
    for (var bit = 0u; bit < 32u; bit++) {
        let corner = corners(slot, 32u * (word & 1u) + bit);
        let highest = max(
            max(max(density[corner[0]], density[corner[1]]), max(density[corner[2]], density[corner[3]])),
            max(max(density[corner[4]], density[corner[5]]), max(density[corner[6]], density[corner[7]])),
        );
        bits |= select(0u, 1u << bit, highest > task.theta_min);
    }
    occupied[word] = bits;
}
