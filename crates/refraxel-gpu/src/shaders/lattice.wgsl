// Where the nodes and cells of a grid of coefficients lie, and how far each cell is from the nearest marked one: `lattice.rs` of
// the core. Lattice 2 r holds the index of region r, lattice 2 r + 1 its level set.

// The fields are those of `bodies::Lattice` in Rust.
struct Lattice {
    lowest: vec3<f32>,
    // Where the coefficients begin.
    first: u32,
    // Nodes per scene unit.
    scale: vec3<f32>,
    // Where the distances of cells begin [byte].
    cells: u32,
    nodes: vec3<u32>,
    // Edge of a voxel, the shortest [scene unit].
    voxel: f32,
}

// Node coordinates of a world point.
fn lattice_node(l: u32, x: vec3<f32>) -> vec3<f32> {
    return (x - lattices[l].lowest) * lattices[l].scale;
}

// Whether node coordinates lie in the box.
fn lattice_holds(l: u32, g: vec3<f32>) -> bool {
    return all(g >= vec3<f32>(0.0)) && all(g <= vec3<f32>(lattices[l].nodes - vec3<u32>(1u)));
}

// The cell of node coordinates in the box.
fn lattice_cell(l: u32, g: vec3<f32>) -> vec3<u32> {
    return min(vec3<u32>(g), lattices[l].nodes - vec3<u32>(2u));
}

// True for the cells along the faces of the box.
fn is_rim(l: u32, cell: vec3<u32>) -> bool {
    return any(cell == vec3<u32>(0u)) || any(cell == lattices[l].nodes - vec3<u32>(2u));
}

// Distance [cell] from a cell to the nearest marked one.
fn clearance_of(l: u32, cell: vec3<u32>) -> u32 {
    let n = lattices[l].nodes - vec3<u32>(1u);
    let i = lattices[l].cells + cell.x + n.x * (cell.y + n.y * cell.z);
    return (clearance[i >> 2u] >> (8u * (i & 3u))) & 255u;
}

// The same at node coordinates; OUTSIDE outside of the box.
fn clearance_at(l: u32, g: vec3<f32>) -> u32 {
    if (!lattice_holds(l, g)) {
        return OUTSIDE;
    }
    return clearance_of(l, lattice_cell(l, g));
}

// The first t in [from, end) at which the line x + t p lies in a marked cell; FAR where there is none.
fn first_marked(l: u32, x: vec3<f32>, p: vec3<f32>, from_t: f32, end: f32) -> f32 {
    let velocity = p * lattices[l].scale;
    let nudge = NUDGE / max_element(abs(velocity));
    let start = lattice_node(l, x);
    let last = vec3<f32>(lattices[l].nodes - vec3<u32>(1u));
    var t = from_t;
    while (t < end) {
        let g = clamp(start + velocity * t, vec3<f32>(0.0), last);
        let cell = lattice_cell(l, g);
        let distance = clearance_of(l, cell);
        if (distance == 0u) {
            return t;
        }
        // No cell at a smaller distance is marked: leave their block.
        let face = vec3<f32>(cell) + select(vec3<f32>(1.0 - f32(distance)), vec3<f32>(f32(distance)), velocity > vec3<f32>(0.0));
        let leave = select(vec3<f32>(FAR), (face - g) / velocity, velocity != vec3<f32>(0.0));
        t += min(leave.x, min(leave.y, leave.z)) + nudge;
    }
    return FAR;
}
