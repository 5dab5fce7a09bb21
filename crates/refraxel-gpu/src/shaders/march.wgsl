// Where a path meets matter, theory (3.1) and (3.9): the march of the CPU backend, one ray per invocation.

// Where the march along a path stands.
struct Front {
    // x(t) = start + t momentum on the segment.
    start: vec3<f32>,
    momentum: vec3<f32>,
    // Of a projective grid: t where the segment begins, the depth there, and how fast it grows with t.
    entry: vec3<f32>,
    // The end of the segment. Here and below, points are even steps of a parameter apart: t, but in a projective grid the λ of
    // `Perspective` in Rust.
    end: f32,
    // Parameter of the first point of a group, length of a step, and how much longer it is than inside the box.
    first: f32,
    dt: f32,
    growth: f32,
    // Steps that a leap over the edge of a brick takes.
    steps_per_brick: f32,
    // The next point of the group.
    lane: u32,
    // Steps from the start of the next segment to its first point.
    phase: f32,
    transmittance: f32,
    // How much of a thin sample is due, theory (4.6).
    due: f32,
    // Nothing behind can be seen.
    opaque: bool,
}

// A quadrature point that matters.
struct Sample {
    slot: u32,
    local: u32,
    corner: array<u32, 8>,
    weight: array<f32, 8>,
    fraction: vec3<f32>,
    t: f32,
    // Optical depth τ, dτ/dθ, opacity 1 − e^(−τ), and the transmittance in front.
    tau: f32,
    slope: f32,
    alpha: f32,
    before: f32,
}

// The front before the first segment of a path.
fn front_of(offset: f32) -> Front {
    var front = Front();
    front.phase = offset;
    front.due = fract(offset * 4096.0 + 0.5); // `thinning_phase` in Rust
    front.transmittance = 1.0;
    return front;
}

// Begin a segment.
fn enter(front: ptr<function, Front>, start: vec3<f32>, momentum: vec3<f32>, range: vec2<f32>) {
    (*front).start = start;
    (*front).momentum = momentum;
    (*front).end = range.y;
    (*front).lane = 0u;
    if (scene.extent == PROJECTIVE) {
        begin_perspective(front, range);
        return;
    }
    begin_group(front, range.x, (*front).phase);
}

// A group of points at equal distances from `t` on, the first of them `phase` steps behind it.
fn begin_group(front: ptr<function, Front>, t: f32, phase: f32) {
    let per_t = 1.0 / length((*front).momentum);
    let growth = growth_at((*front).start + (*front).momentum * t);
    (*front).growth = growth;
    (*front).dt = task.step * growth * per_t;
    (*front).first = t + phase * (*front).dt;
    let nodes_per_step = fastest((*front).momentum) * task.step * per_t * stretch(growth);
    (*front).steps_per_brick = BRICK / nodes_per_step;
}

// Points at even steps through a projective grid.
fn begin_perspective(front: ptr<function, Front>, range: vec2<f32>) {
    let at = (*front).start + (*front).momentum * range.x;
    (*front).entry = vec3<f32>(range.x, dot(scene.ahead, at - scene.center), dot(scene.ahead, (*front).momentum));
    let length_t = range.y - range.x;
    (*front).end = length_t / ((*front).entry.y * ((*front).entry.y + (*front).entry.z * length_t));
    let nodes = rate((*front).start, (*front).momentum) * scene.nodes_per_unit;
    (*front).growth = 1.0;
    (*front).dt = task.step / (length(nodes) * scene.voxel);
    (*front).first = (*front).phase * (*front).dt;
    (*front).steps_per_brick = BRICK / (max_element(abs(nodes)) * (*front).dt * STRETCH);
}

// t of a parameter of the front's segment.
fn t_of(front: ptr<function, Front>, parameter: f32) -> f32 {
    if (scene.extent != PROJECTIVE) {
        return parameter;
    }
    let scaled = parameter * (*front).entry.y;
    return (*front).entry.x + scaled * (*front).entry.y / (1.0 - scaled * (*front).entry.z);
}

// Go to the next sample of the segment; false, with the phase of the next segment, if there is none.
fn next_sample(front: ptr<function, Front>, sample: ptr<function, Sample>) -> bool {
    var along = (*front).momentum * scene.unit_per_world;
    var origin = ((*front).start - scene.center) * scene.unit_per_world;
    if (scene.extent == PROJECTIVE) {
        along = rate((*front).start, (*front).momentum);
        origin = unit((*front).start + (*front).momentum * (*front).entry.x);
    }
    loop {
        if (scene.extent == CONTRACTED && (*front).lane >= GROUP && (*front).first + f32(GROUP - 1u) * (*front).dt <= (*front).end) {
            // A new step length, half a step in.
            (*front).lane = 0u;
            begin_group(front, (*front).first + (f32(GROUP) - 0.5) * (*front).dt, 0.5);
        }
        let t = (*front).first + f32((*front).lane) * (*front).dt;
        // Written so that it also ends the march of a ray that is not a number.
        if (!(t <= (*front).end)) {
            (*front).phase = (t - (*front).end) / (*front).dt;
            return false;
        }
        let g = node_of_unit(origin + t * along);
        let base = min(vec3<u32>(g), scene.last_cell);
        let entry = table[dot(base >> vec3<u32>(2u), scene.brick_strides)];
        if (entry <= 0) {
            let leap = u32(f32(-entry - 1) * (*front).steps_per_brick);
            (*front).lane += max(leap, 1u);
            continue;
        }
        (*front).lane += 1u;
        let slot = u32(entry);
        let local = (base.x & 3u) | ((base.y & 3u) << 2u) | ((base.z & 3u) << 4u);
        if (((occupied[2u * slot + (local >> 5u)] >> (local & 31u)) & 1u) == 0u) {
            continue;
        }
        let fraction = g - vec3<f32>(base);
        let corner = corners(slot, local);
        let w = trilinear_weights(fraction);
        let theta = w[0] * density[corner[0]] + w[1] * density[corner[1]] + w[2] * density[corner[2]]
            + w[3] * density[corner[3]] + w[4] * density[corner[4]] + w[5] * density[corner[5]]
            + w[6] * density[corner[6]] + w[7] * density[corner[7]];
        if (theta < task.theta_min) {
            continue;
        }
        let scale_length = scene.density_scale * task.step * (*front).growth;
        var tau = scale_length * softplus(theta);
        var slope = scale_length * logistic(theta);
        if (tau < task.thin) {
            // Left out by chance, or counted for those that are, theory (4.6).
            let share = tau / task.thin;
            (*front).due += share;
            if ((*front).due < 1.0) {
                continue;
            }
            (*front).due -= 1.0;
            tau = task.thin;
            slope /= share;
        }
        (*sample).slot = slot;
        (*sample).local = local;
        (*sample).corner = corner;
        (*sample).weight = w;
        (*sample).fraction = fraction;
        (*sample).t = t_of(front, t);
        (*sample).tau = tau;
        (*sample).slope = slope;
        (*sample).alpha = opacity_of(tau);
        (*sample).before = (*front).transmittance;
        (*front).transmittance *= 1.0 - (*sample).alpha;
        (*front).opaque = (*front).transmittance < task.min_transmittance;
        return true;
    }
    return false;
}

// Begin the path of a straight ray; false if it misses the grid.
fn enter_straight(front: ptr<function, Front>, origin: vec3<f32>, direction: vec3<f32>) -> bool {
    let range = clip(origin, direction, task.near);
    if (!(range.x < range.y)) {
        return false;
    }
    enter(front, origin, direction, range);
    return true;
}
