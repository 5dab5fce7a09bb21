// Which straight rays may bend: those that meet something refractive. `gate.rs` of the trainer.

// The fields are those of `gates::Gate` in Rust.
struct Gate {
    lowest: vec3<f32>,
    // Where its shares begin [byte]; NONE: rays bend that meet the box.
    shares: u32,
    highest: vec3<f32>,
    // Where its clearances begin [byte].
    clearances: u32,
    // Nodes per scene unit.
    scale: vec3<f32>,
    padding_0: u32,
    nodes: vec3<u32>,
    padding_1: u32,
}

fn gate_byte(at: u32) -> u32 {
    return (gate_bytes[at >> 2u] >> (8u * (at & 3u))) & 255u;
}

fn admits(origin: vec3<f32>, direction: vec3<f32>) -> bool {
    for (var k = 0u; k < selection.regions; k++) {
        if (meets(k, origin, direction)) {
            return true;
        }
    }
    return false;
}

// Whether a share of at least one half lies at one of the points along a ray. Cells that cannot hold such a point are hopped over.
fn meets(k: u32, origin: vec3<f32>, direction: vec3<f32>) -> bool {
    let lowest = gates[k].lowest;
    let highest = gates[k].highest;
    let a = clip_axis(origin.x, direction.x, lowest.x, highest.x);
    let b = clip_axis(origin.y, direction.y, lowest.y, highest.y);
    let c = clip_axis(origin.z, direction.z, lowest.z, highest.z);
    let enter = max(0.0, max(a.x, max(b.x, c.x)));
    let leave = min(a.y, min(b.y, c.y));
    if (!(enter < leave) || gates[k].shares == NONE) {
        return enter < leave;
    }
    let start = (origin - lowest) * gates[k].scale;
    let speed = direction * gates[k].scale;
    let step = GATE_STEP / length(speed);
    let nodes = gates[k].nodes;
    var s = enter;
    while (s <= leave) {
        let at = start + speed * s;
        let cell = min(vec3<u32>(max(at, vec3<f32>(0.0))), nodes - 2u);
        let clear = gate_byte(gates[k].clearances + cell.x + (nodes.x - 1u) * (cell.y + (nodes.y - 1u) * cell.z));
        if (clear == 0u) {
            if (share_at(k, cell, at - vec3<f32>(cell)) >= GATE_HALF) {
                return true;
            }
            s += step;
        } else {
            let before = vec3<f32>(cell);
            let faces = select(before + 1.0 - f32(clear), before + f32(clear), speed > vec3<f32>(0.0));
            let exits = select((faces - start) / speed, vec3<f32>(FAR), speed == vec3<f32>(0.0));
            s = max(min(exits.x, min(exits.y, exits.z)), s) + GATE_HOP * step;
        }
    }
    return false;
}

// Trilinear share in 1/255 at a fraction of a cell.
fn share_at(k: u32, cell: vec3<u32>, f: vec3<f32>) -> f32 {
    let nodes = gates[k].nodes;
    var sum = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let node = cell + vec3<u32>(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
        let at = gates[k].shares + node.x + nodes.x * (node.y + nodes.y * node.z);
        sum += trilinear_weight(f, corner) * f32(gate_byte(at));
    }
    return sum;
}
