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
    // Surfaces met.
    events: u32,
    // The region around the camera, where it has no sharp surface and its index is not that of vacuum; or NO_REGION.
    camera: u32,
    ended: bool,
}

// A straight piece of a path: x(t) = start + t momentum, which the field shows for t in `range`; and how it came about, `Step` of
// the core.
struct Segment {
    start: vec3<f32>,
    momentum: vec3<f32>,
    range: vec2<f32>,
    // Weight of the force at the start; 0 for none.
    kick: f32,
    // Length in t to the next point, or to the surface.
    drift: f32,
    // The region that rules along the segment and whose field kicks.
    within: u32,
    // The body on whose surface the segment ends, and what rules on the other side of it, where there is an event.
    surface: u32,
    beyond: u32,
    // Bits: REFRACTS, REFLECTS, FROM_INSIDE; 0 where the segment ends without an event.
    event: u32,
    // Length of the end kick.
    late: f32,
    // Steps of the lattice, 0 for a hop outside, and (∇w, w) at the start where there are some.
    lattice: u32,
    field: vec4<f32>,
    // The ray on the surface.
    arrival: Arrival,
}

// The path of a camera ray, before its first segment.
fn tracer_of(origin: vec3<f32>, direction: vec3<f32>) -> Tracer {
    var t = Tracer();
    let ruling = ruling_at(origin);
    t.x = origin;
    let n = sqrt(2.0 * field_sample(ruling, origin).w);
    t.p = direction * n;
    t.visits = NO_REGION;
    t.body = NO_REGION;
    t.camera = NO_REGION;
    if (ruling == NO_REGION) {
        return t;
    }
    if (regions[ruling].body != NO_BODY) {
        t.body = ruling;
    } else if (abs(n - 1.0) >= FLAT) {
        t.camera = ruling;
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
//
// What a body, a smooth region and vacuum have in common stands here once: compilers copy functions to where they are called.
fn next_segment(t: ptr<function, Tracer>, out: ptr<function, Segment>) -> bool {
    if ((*t).ended || (*t).segments >= bending.most_segments || (*t).lattice >= MAX_LATTICE) {
        return false;
    }
    (*out).kick = 0.0;
    (*out).lattice = 0u;
    let in_body = (*t).body != NO_REGION;
    var ahead = step_ahead(t, out);
    if (in_body && !(ahead.drift > 0.0)) {
        return false;
    }
    var met = Met(FAR, NO_REGION);
    if (in_body || ahead.region == NO_REGION) {
        met = first_met(t, ahead);
    }
    if (met.region != NO_REGION && regions[met.region].body != NO_BODY) {
        var late = 0.0;
        if (in_body && ahead.steps > 0u && !is_flat(ahead.region, (*t).x + (*t).p * met.t)) {
            // Kicks so far reach to the middle of the interval of the lattice that the surface cuts short.
            let h = regions[ahead.region].step;
            late = met.t - (min(floor(met.t / h), f32(ahead.steps) - 1.0) + 0.5) * h;
        }
        end_on_surface(t, out, met.t, met.region, in_body && met.region == ahead.region, late);
        return true;
    }
    if (in_body && ahead.steps == 0u) {
        // No way out of a body of one index.
        return false;
    }
    var within = ahead.region;
    var range = vec2<f32>(0.0, ahead.drift);
    if (ahead.region == NO_REGION) {
        // To the next smooth region, or to the end of the scene.
        within = select(NO_REGION, (*t).camera, (*t).segments == 0u);
        range = visible(t, met.t);
        ahead.drift = select(met.t, range.y, met.region == NO_REGION);
        (*t).ended = met.region == NO_REGION;
        (*t).visits = met.region;
        (*t).lattice = 0u;
    } else if (in_body) {
        range = visible(t, ahead.drift);
    }
    note(t, out, range, ahead.drift, within);
    (*out).lattice = ahead.steps;
    (*t).x += (*t).p * ahead.drift;
    (*t).lattice += ahead.steps;
    return true;
}

// The step that follows if nothing comes in its way.
struct Ahead {
    // The region whose field rules, NO_REGION in vacuum.
    region: u32,
    drift: f32,
    // Steps of its lattice; 0 in vacuum, and in a body of one index, where the step leads to the face of the box.
    steps: u32,
}

// One step of the lattice, theory (2.10), or as many as lead through flat cells; with the kick before it.
fn step_ahead(t: ptr<function, Tracer>, out: ptr<function, Segment>) -> Ahead {
    let in_body = (*t).body != NO_REGION;
    let region = select((*t).visits, (*t).body, in_body);
    if (region == NO_REGION) {
        return Ahead(NO_REGION, FAR, 0u);
    }
    if (in_body && regions[region].is_uniform != 0u) {
        return Ahead(region, clip_region(region, (*t).x, (*t).p).y, 0u);
    }
    let h = regions[region].step;
    let is_first = (*t).lattice == 0u;
    (*out).field = index_sample(region, (*t).x);
    if ((in_body || !is_first) && is_flat(region, (*t).x)) {
        let flat = run(region, (*t).x, (*t).p, h, MAX_LATTICE - (*t).lattice);
        if (!in_body && flat.outside) {
            (*t).search_from = h * f32(flat.steps);
            (*t).visits = NO_REGION;
            return Ahead(NO_REGION, FAR, 0u);
        }
        return Ahead(region, h * f32(flat.steps), flat.steps);
    }
    (*out).kick = select(h, 0.5 * h, is_first);
    (*t).p += (*out).field.xyz * (*out).kick;
    return Ahead(region, h, 1u);
}

// What a drift meets first: the surface of a body, or the marked cells of a smooth region.
struct Met {
    t: f32,
    region: u32,
}

// In vacuum any region; in a body its own surface, and those of bodies that rule over it.
fn first_met(t: ptr<function, Tracer>, ahead: Ahead) -> Met {
    let in_body = ahead.region != NO_REGION;
    var met = Met(FAR, NO_REGION);
    for (var k = select(0u, ahead.region, in_body); k < bending.regions; k++) {
        let is_own = in_body && k == ahead.region;
        let is_body = regions[k].body != NO_BODY;
        let inside = clip_region(k, (*t).x, (*t).p);
        if (!is_own && (!(inside.x < inside.y) || (in_body && !is_body))) {
            continue;
        }
        var range = vec2<f32>(max(inside.x, (*t).search_from), min(inside.y, min(met.t, ahead.drift)));
        if (is_own) {
            range = vec2<f32>(0.0, ahead.drift);
        }
        var found = FAR;
        if (is_body) {
            found = first_crossing(k, (*t).x, (*t).p, range, select(1.0, -1.0, is_own));
        } else {
            found = first_marked(2u * k, (*t).x, (*t).p, range.x, range.y);
        }
        if (found < met.t) {
            met = Met(found, k);
        }
    }
    return met;
}

// Note a segment of length `drift` within a region that the tracer stands before, behind its kick.
fn note(t: ptr<function, Tracer>, out: ptr<function, Segment>, range: vec2<f32>, drift: f32, within: u32) {
    (*out).start = (*t).x;
    (*out).momentum = (*t).p;
    (*out).range = range;
    (*out).drift = drift;
    (*out).within = within;
    (*out).event = 0u;
    (*out).late = 0.0;
    (*t).segments += 1u;
}

// A drift that ends on the surface of `body`, with an end kick of length `late`.
fn end_on_surface(t: ptr<function, Tracer>, out: ptr<function, Segment>, tau: f32, body: u32, from_inside: bool, late: f32) {
    let within = (*t).body;
    note(t, out, visible(t, tau), tau, within);
    let turned = turned_at((*t).x, (*t).p, tau, body, from_inside, within, late);
    (*t).x = turned.x;
    (*t).p = turned.p;
    (*t).body = select(within, turned.beyond, turned.passes);
    (*t).events += 1u;
    (*out).surface = body;
    (*out).beyond = turned.beyond;
    (*out).event = select(REFLECTS, REFRACTS, turned.passes) | select(0u, FROM_INSIDE, from_inside);
    (*out).late = late;
    (*out).arrival = turned.arrival;
    (*t).lattice = 0u;
    (*t).search_from = 0.0;
}
