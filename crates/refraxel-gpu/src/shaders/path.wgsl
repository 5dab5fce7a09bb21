// What is seen along a path, and the places from which its segments can be computed again.

// Where a path stands before every REPLAY-th segment, and at its end: the tracer and the march.
struct Checkpoint {
    x: vec3<f32>,
    search_from: f32,
    p: vec3<f32>,
    phase: f32,
    // The radiance collected so far.
    collected: vec3<f32>,
    transmittance: f32,
    // Optical thickness of what absorbs, theory (7.17).
    thickness: vec3<f32>,
    events: u32,
    body: u32,
    // Before the first segment, the region around the camera.
    visits: u32,
    lattice: u32,
    segments: u32,
}

// The row of the end of a path.
const PATH_END: u32 = MAX_SEGMENTS / REPLAY;

// The direction in which a path whose momentum at its end is p reaches the background.
fn exit_of(ray: u32, p: vec3<f32>) -> vec3<f32> {
    return select(p, normalize(p), lessons[ray].bends != 0u);
}

// What a path has seen so far.
struct Sight {
    collected: vec3<f32>,
    thickness: vec3<f32>,
}

// Where the checkpoint of a row lies.
fn place_of(row: u32, ray: u32) -> u32 {
    return row * bending.keeps + ray - bending.first;
}

fn tracer_at(c: Checkpoint) -> Tracer {
    var t = Tracer(c.x, c.p, c.body, c.visits, c.lattice, c.search_from, c.segments, c.events, NO_REGION, false);
    if (c.segments == 0u) {
        t.camera = c.visits;
        t.visits = NO_REGION;
    }
    return t;
}

fn front_at(c: Checkpoint) -> Front {
    var front = front_of(c.phase);
    front.transmittance = c.transmittance;
    front.opaque = c.transmittance < task.min_transmittance;
    return front;
}
