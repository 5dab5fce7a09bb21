// What surfaces mirror into paths, theory (7.1)–(7.12). The reflections of a path are a list with links in both directions. Its head
// is the record of the number of the ray in its portion; surfaces are behind the heads of all rays.

// The fields are those of `reflections::Reflection` in Rust.
struct Reflection {
    // The place, and the number of the segment that ends there.
    position: vec3<f32>,
    segment: u32,
    // Unit direction of the mirrored ray, away from the surface.
    direction: vec3<f32>,
    // The mirrored share of the light for a strength of 1.
    reflectance: f32,
    // Unit normal, out of the body.
    normal: vec3<f32>,
    // The region that the surface belongs to, and that in which the ray arrives: NO_REGION for vacuum.
    region: u32,
    // Momentum on arrival; of a transition, at its steepest point.
    p: vec3<f32>,
    within: u32,
    // Normal momenta and w on both sides.
    before: f32,
    after: f32,
    w_before: f32,
    w_after: f32,
    // Of a transition, its first point and its last: place, number of the segment that begins there, smooth region or NO_REGION.
    first: vec3<f32>,
    first_segment: u32,
    last: vec3<f32>,
    last_segment: u32,
    first_region: u32,
    last_region: u32,
    // Slope of w at the steepest point.
    slope: f32,
    // SHARP, or whether w RISES or FALLS along the ray.
    trend: u32,
    // 0 where there is none.
    previous: u32,
    next: u32,
    padding_0: u32,
    padding_1: u32,
    // The mirrored light, before what absorbs on the way to the camera.
    light: vec3<f32>,
    // Transmittance of the field before the surface.
    reached: f32,
    // What the section before the surface shows, and its transmittance.
    collected: vec3<f32>,
    through: f32,
    // Optical thickness of what absorbs before the surface.
    thickness: vec3<f32>,
    padding_2: u32,
    // What is seen behind the surface.
    behind: vec3<f32>,
    padding_3: u32,
    // dLoss/d(that) for a transmittance of 1 before the path.
    d_behind: vec3<f32>,
    d_before: f32,
    d_thickness: vec3<f32>,
    d_after: f32,
    // dLoss/d(place) and dLoss/d(momentum) there.
    d_position: vec3<f32>,
    d_w_before: f32,
    d_p: vec3<f32>,
    d_w_after: f32,
    // dLoss/d(first and last point of a transition).
    d_first: vec3<f32>,
    padding_4: u32,
    d_last: vec3<f32>,
    padding_5: u32,
}

const SHARP: u32 = 0u;
const RISES: u32 = 1u;
const FALLS: u32 = 2u;

fn mirrors() -> bool {
    return (task.wants & MIRRORS) != 0u;
}

// Whether a record is that of a surface, and no head of a list.
fn is_surface(reflection: u32) -> bool {
    return reflection >= bending.rays;
}

// The next reflection of a path if it lies among so many first segments; 0 where there is none.
fn next_reflection(reflection: u32, segments: u32) -> u32 {
    if (!mirrors()) {
        return 0u;
    }
    let next = reflections[reflection].next;
    return select(0u, next, next != 0u && reflections[next].segment < segments);
}
