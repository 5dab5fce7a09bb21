// Bent rays: from the camera to the exit, segment by segment: `trace.rs`, `body.rs` and `hop.rs` of the core.

// Where the path of a ray stands.
struct Tracer {
    x: vec3<f32>,
    p: vec3<f32>,
    // The body that rules; NO_REGION outside of all bodies.
    body: u32,
    // The region without a sharp surface that is marched through, or NO_REGION.
    visits: u32,
    // Steps of the lattice so far, in the body or the region.
    lattice: u32,
    // Where the search for the next region begins, in t.
    search_from: f32,
    segments: u32,
    ended: bool,
}

// A straight piece of a path: x(t) = start + t momentum, which the field shows for t in `range`.
struct Segment {
    start: vec3<f32>,
    momentum: vec3<f32>,
    range: vec2<f32>,
}

// The path of a camera ray, before its first segment.
fn tracer_of(origin: vec3<f32>, direction: vec3<f32>) -> Tracer {
    var t = Tracer();
    let ruling = ruling_at(origin);
    t.x = origin;
    t.p = direction * sqrt(2.0 * field_sample(ruling, origin).w);
    t.visits = NO_REGION;
    t.body = NO_REGION;
    if (ruling != NO_REGION) {
        t.body = select(NO_REGION, ruling, regions[ruling].is_body != 0u);
    }
    return t;
}

// The part of a hop of length `hop` inside the grid of the field.
fn visible(t: ptr<function, Tracer>, hop: f32) -> vec2<f32> {
    let near = select(0.0, task.near / length((*t).p), (*t).segments == 0u);
    let inside = clip((*t).x, (*t).p, near);
    if (inside.x < inside.y && inside.x < hop) {
        return vec2<f32>(inside.x, min(inside.y, hop));
    }
    return vec2<f32>(select(hop, 0.0, hop == FAR));
}

// Follow the lattice of steps of length h through the flat cells of a region, at most `limit` steps: the step that lies in a cell
// that must be marched, or outside the box (then is `outside` set), or the last one allowed.
struct Run {
    steps: u32,
    outside: bool,
}

fn run(region: u32, x: vec3<f32>, p: vec3<f32>, h: f32, limit: u32) -> Run {
    let l = 2u * region;
    let reach = max_element(abs(p * lattices[l].scale)) * h;
    var m = 0u;
    while (m < limit) {
        let c = clearance_at(l, lattice_node(l, x + p * (h * f32(m))));
        if (c == OUTSIDE) {
            return Run(m, true);
        }
        if (c == 0u) {
            return Run(m, false);
        }
        m += max(u32((f32(c) - 1.0) / reach), 1u);
    }
    return Run(limit, false);
}

// The next segment of a path, behind which the tracer stands then; false at its end.
fn next_segment(t: ptr<function, Tracer>, out: ptr<function, Segment>) -> bool {
    if ((*t).ended || (*t).segments >= MAX_SEGMENTS || (*t).lattice >= MAX_LATTICE) {
        return false;
    }
    if ((*t).body != NO_REGION) {
        return cross_body(t, out);
    }
    if ((*t).visits != NO_REGION) {
        if (visit(t, out)) {
            return true;
        }
        (*t).visits = NO_REGION;
    }
    return leave_vacuum(t, out);
}

// Note a segment of length `drift` that the tracer stands before.
fn note(t: ptr<function, Tracer>, out: ptr<function, Segment>, range: vec2<f32>) {
    (*out).start = (*t).x;
    (*out).momentum = (*t).p;
    (*out).range = range;
    (*t).segments += 1u;
}

// A drift that ends on the surface of `body`, with an end kick of length `late`.
fn end_on_surface(t: ptr<function, Tracer>, out: ptr<function, Segment>, tau: f32, body: u32, from_inside: bool, late: f32) {
    note(t, out, visible(t, tau));
    let turned = turned_at((*t).x, (*t).p, tau, body, from_inside, (*t).body, late);
    (*t).x = turned.x;
    (*t).p = turned.p;
    (*t).body = turned.into;
    (*t).lattice = 0u;
    (*t).search_from = 0.0;
}

// Outside of all bodies: to the next region, or to the end of the scene.
fn leave_vacuum(t: ptr<function, Tracer>, out: ptr<function, Segment>) -> bool {
    var first = FAR;
    var region = NO_REGION;
    for (var k = 0u; k < arrayLength(&regions); k++) {
        let inside = clip_region(k, (*t).x, (*t).p);
        if (!(inside.x < inside.y)) {
            continue;
        }
        let range = vec2<f32>(max(inside.x, (*t).search_from), min(inside.y, first));
        var found = FAR;
        if (regions[k].is_body != 0u) {
            found = first_crossing(k, (*t).x, (*t).p, range, 1.0);
        } else {
            found = first_marked(2u * k, (*t).x, (*t).p, range.x, range.y);
        }
        if (found < first) {
            first = found;
            region = k;
        }
    }
    if (region == NO_REGION) {
        note(t, out, visible(t, FAR));
        (*t).ended = true;
        return true;
    }
    if (regions[region].is_body != 0u) {
        end_on_surface(t, out, first, region, false, 0.0);
        return true;
    }
    note(t, out, visible(t, first));
    (*t).x += (*t).p * first;
    (*t).visits = region;
    (*t).lattice = 0u;
    return true;
}

// One step through a region without a sharp surface, theory (2.10); false where the ray has left it.
fn visit(t: ptr<function, Tracer>, out: ptr<function, Segment>) -> bool {
    let region = (*t).visits;
    let h = regions[region].step;
    var steps = 1u;
    var kick = select(h, 0.5 * h, (*t).lattice == 0u);
    if ((*t).lattice > 0u && is_flat(region, (*t).x)) {
        let flat = run(region, (*t).x, (*t).p, h, MAX_LATTICE - (*t).lattice);
        if (flat.outside) {
            (*t).search_from = h * f32(flat.steps);
            (*t).lattice = 0u;
            return false;
        }
        steps = flat.steps;
        kick = 0.0;
    }
    if (kick != 0.0) {
        (*t).p += index_sample(region, (*t).x).xyz * kick;
    }
    let drift = h * f32(steps);
    note(t, out, vec2<f32>(0.0, drift));
    (*t).x += (*t).p * drift;
    (*t).lattice += steps;
    return true;
}

// One segment inside the body that rules, to the next surface or the next step; false where no way out is found.
fn cross_body(t: ptr<function, Tracer>, out: ptr<function, Segment>) -> bool {
    let region = (*t).body;
    let h = regions[region].step;
    let uniform_inside = regions[region].is_uniform != 0u;
    var steps = 0u;
    var drift = 0.0;
    if (uniform_inside) {
        drift = clip_region(region, (*t).x, (*t).p).y;
    } else {
        steps = 1u;
        if (is_flat(region, (*t).x)) {
            steps = run(region, (*t).x, (*t).p, h, MAX_LATTICE - (*t).lattice).steps;
        } else {
            let kick = select(h, 0.5 * h, (*t).lattice == 0u);
            (*t).p += index_sample(region, (*t).x).xyz * kick;
        }
        drift = h * f32(steps);
    }
    if (!(drift > 0.0)) {
        return false;
    }
    var first = first_crossing(region, (*t).x, (*t).p, vec2<f32>(0.0, drift), -1.0);
    var surface = region;
    for (var k = region + 1u; k < arrayLength(&regions); k++) {
        let inside = clip_region(k, (*t).x, (*t).p);
        if (regions[k].is_body == 0u || !(inside.x < inside.y)) {
            continue;
        }
        let range = vec2<f32>(inside.x, min(inside.y, min(first, drift)));
        let found = first_crossing(k, (*t).x, (*t).p, range, 1.0);
        if (found < first) {
            first = found;
            surface = k;
        }
    }
    if (first != FAR) {
        var late = 0.0;
        if (!uniform_inside && !is_flat(region, (*t).x + (*t).p * first)) {
            // Kicks so far reach to the middle of the interval of the lattice that the surface cuts short.
            late = first - (min(floor(first / h), f32(steps) - 1.0) + 0.5) * h;
        }
        end_on_surface(t, out, first, surface, surface == region, late);
        return true;
    }
    if (uniform_inside) {
        return false;
    }
    note(t, out, visible(t, drift));
    (*t).x += (*t).p * drift;
    (*t).lattice += steps;
    return true;
}
