// Where paths stand between two dispatches.
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
    // The radiance collected so far, of the section behind the last surface that mirrors.
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
    // Transmittance of the section, and the reflection before it.
    through: f32,
    mirror: u32,
    // How much of a thin sample is due.
    due: f32,
    padding_0: u32,
    padding_1: u32,
}

const GOES_ON: u32 = 1u;
const OVER: u32 = 2u;

// Where the checkpoint of a row lies.
fn place_of(row: u32, ray: u32) -> u32 {
    return row * bending.keeps + ray - bending.first;
}

// The direction in which a path whose momentum at its end is p reaches the background.
fn exit_of(ray: u32, p: vec3<f32>) -> vec3<f32> {
    return select(p, normalize(p), lessons[ray].bends != 0u);
}
