// Which voxels took part in a step: one bit each.

fn touch(voxel: u32) {
    let bit = 1u << (voxel & 31u);
    // Most voxels are touched many times: a look is cheaper than a write.
    if ((atomicLoad(&touched[voxel >> 5u]) & bit) == 0u) {
        atomicOr(&touched[voxel >> 5u], bit);
    }
}
