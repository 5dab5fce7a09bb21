// The paths of rays, where they stand between two dispatches, and what is seen along them.
//
// A path may be long, and devices bound what one dispatch may do. So each takes every path `replay` segments further; the host sends
// dispatches until all paths are over.

// Where a path stands: the tracer and the march. Row 0 of `checkpoints` says so of each ray; of rays that learn, row 1 + k says it
// before the k-th block of `replay` segments.
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
    depth: f32,
    // Length of the path.
    arc: f32,
    // 0 before the first dispatch, then GOES_ON or OVER.
    stage: u32,
    padding_0: u32,
}

const GOES_ON: u32 = 1u;
const OVER: u32 = 2u;

// What a path has seen so far.
struct Sight {
    collected: vec3<f32>,
    depth: f32,
    thickness: vec3<f32>,
    arc: f32,
}

// Where the checkpoint of a row lies.
fn place_of(row: u32, ray: u32) -> u32 {
    return row * bending.keeps + ray - bending.first;
}

// The direction in which a path whose momentum at its end is p reaches the background.
fn exit_of(ray: u32, p: vec3<f32>) -> vec3<f32> {
    return select(p, normalize(p), lessons[ray].bends != 0u);
}

// The path of a ray before its first segment.
fn path_of(ray: u32) -> Tracer {
    if (lessons[ray].bends != 0u) {
        return tracer_of(lessons[ray].origin, lessons[ray].direction);
    }
    var t = Tracer();
    t.x = lessons[ray].origin;
    t.p = lessons[ray].direction;
    t.body = NO_REGION;
    t.visits = NO_REGION;
    t.camera = NO_REGION;
    return t;
}

// The next segment; false at the end of the path.
fn advance(t: ptr<function, Tracer>, bends: bool, out: ptr<function, Segment>) -> bool {
    if (bends) {
        return next_segment(t, out);
    }
    if ((*t).ended) {
        return false;
    }
    (*out).kick = 0.0;
    let range = clip((*t).x, (*t).p, task.near);
    note(t, out, range, range.y, NO_REGION);
    (*t).ended = true;
    return true;
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

fn checkpoint_of(t: ptr<function, Tracer>, front: ptr<function, Front>, sight: Sight, stage: u32) -> Checkpoint {
    let visits = select((*t).visits, (*t).camera, (*t).segments == 0u);
    return Checkpoint(
        (*t).x, (*t).search_from, (*t).p, (*front).phase, sight.collected, (*front).transmittance, sight.thickness,
        (*t).events, (*t).body, visits, (*t).lattice, (*t).segments, sight.depth, sight.arc, stage, 0u,
    );
}
