// Sparse bricks of 4³ nodes: `grid/bricks.rs` of refraxel-core.

// One of the voxels around a cell.
fn corner_of(slot: u32, local: u32, k: u32) -> u32 {
    let node = vec3<u32>(local & 3u, (local >> 2u) & 3u, local >> 4u) + vec3<u32>(k & 1u, (k >> 1u) & 1u, k >> 2u);
    let brick = node >> vec3<u32>(2u);
    let there = node & vec3<u32>(3u);
    return forward[slot * 8u + brick.x + 2u * brick.y + 4u * brick.z] + there.x + 4u * there.y + 16u * there.z;
}

// All voxels around a cell; corner k lies at +x for bit 0, +y for bit 1, +z for bit 2.
fn corners(slot: u32, local: u32) -> array<u32, 8> {
    let low = vec3<u32>(local & 3u, (local >> 2u) & 3u, local >> 4u);
    let high = low + 1u;
    // Where the upper corners lie: in the next brick along an axis or in the same one, and where there.
    let next = high >> vec3<u32>(2u);
    let there = high & vec3<u32>(3u);
    let row = slot * 8u;
    let b = vec3<u32>(next.x, next.y << 1u, next.z << 2u);
    let y = vec2<u32>(low.y, there.y) << vec2<u32>(2u);
    let z = vec2<u32>(low.z, there.z) << vec2<u32>(4u);
    return array<u32, 8>(
        forward[row] + low.x + y.x + z.x,
        forward[row + b.x] + there.x + y.x + z.x,
        forward[row + b.y] + low.x + y.y + z.x,
        forward[row + b.x + b.y] + there.x + y.y + z.x,
        forward[row + b.z] + low.x + y.x + z.y,
        forward[row + b.x + b.z] + there.x + y.x + z.y,
        forward[row + b.y + b.z] + low.x + y.y + z.y,
        forward[row + b.x + b.y + b.z] + there.x + y.y + z.y,
    );
}
