// Bent rays, theory (2.10) and (2.24)–(2.26): where they meet surfaces, and what becomes of them there.

// Steps of the search for a crossing in one body, steps through one field, and surfaces of a path.
const MOST_SAMPLES: u32 = 1024u;
const MOST_STEPS: u32 = 1024u;
const MOST_EVENTS: u32 = 24u;
// Distance of two samples of φ, and how far behind a surface the search for the next one begins [voxel].
const SPACING: f32 = 0.5;
const BEHIND: f32 = 0.02;

// The interval of t in which a line lies in the box of a region.
fn clip_region(r: u32, x: vec3<f32>, p: vec3<f32>) -> vec2<f32> {
    let low = regions[r].lowest;
    let high = low + vec3<f32>(regions[r].nodes - 1u) / regions[r].nodes_per_unit;
    let a = clip_axis(x.x, p.x, low.x, high.x);
    let b = clip_axis(x.y, p.y, low.y, high.y);
    let c = clip_axis(x.z, p.z, low.z, high.z);
    return vec2<f32>(max(a.x, max(b.x, c.x)), min(a.y, min(b.y, c.y)));
}

// Cells around that of a place without the surface of a body.
fn clearance_at(r: u32, at: vec3<f32>) -> u32 {
    let n = regions[r].nodes - 1u;
    let cell = min(vec3<u32>(max(at, vec3<f32>(0.0))), n - 1u);
    let i = regions[r].clearance + cell.x + n.x * (cell.y + n.y * cell.z);
    return (clearances[i >> 2u] >> (8u * (i & 3u))) & 255u;
}

// The interval of t in which a line is below all planes of a body.
fn below_planes(r: u32, x: vec3<f32>, p: vec3<f32>) -> vec2<f32> {
    let start = (x - regions[r].lowest) * regions[r].nodes_per_unit;
    let velocity = p * regions[r].nodes_per_unit;
    var below = vec2<f32>(-FAR, FAR);
    for (var k = 0u; k < regions[r].planes; k++) {
        let plane = plane_of(r, k);
        below = clip_plane(below, plane.w + dot(plane.xyz, start), dot(plane.xyz, velocity));
    }
    return below;
}

// The first t in a range at which a line leaves its side of the surface of a body: side +1 is outside, −1 inside. −1: never.
fn first_crossing(r: u32, x: vec3<f32>, p: vec3<f32>, range: vec2<f32>, side: f32) -> f32 {
    if (regions[r].planes == 0u) {
        return crossing_of_spline(r, x, p, range, side);
    }
    let below = below_planes(r, x, p);
    let is_of_planes = (regions[r].kind & IS_OF_PLANES) != 0u;
    if (side < 0.0) {
        let end = select(range.x, max(range.x, below.y), below.x < below.y);
        if (!is_of_planes) {
            let t = crossing_of_spline(r, x, p, vec2<f32>(range.x, min(end, range.y)), side);
            if (t >= 0.0) {
                return t;
            }
        }
        return select(-1.0, end, end <= range.y);
    }
    // Nothing comes back below a plane that it has left, or is about to leave.
    let behind = BEHIND / max_element(abs(p * regions[r].nodes_per_unit));
    if (below.x >= below.y || below.x > range.y || below.y <= range.x + behind) {
        return -1.0;
    }
    if (below.x >= range.x && (is_of_planes || level_of_spline(r, x + below.x * p).w <= 0.0)) {
        return below.x;
    }
    if (is_of_planes) {
        return -1.0;
    }
    return crossing_of_spline(r, x, p, vec2<f32>(max(below.x, range.x), min(below.y, range.y)), side);
}

// The same of its level set, whatever planes there are.
fn crossing_of_spline(r: u32, x: vec3<f32>, p: vec3<f32>, range: vec2<f32>, side: f32) -> f32 {
    let velocity = p * regions[r].nodes_per_unit;
    let per_voxel = 1.0 / max_element(abs(velocity));
    var t = range.x;
    var before = vec2<f32>(t, 1.0);
    var near = false;
    for (var k = 0u; k < MOST_SAMPLES; k++) {
        if (t > range.y) {
            break;
        }
        let clear = clearance_at(r, (x + t * p - regions[r].lowest) * regions[r].nodes_per_unit);
        if (clear > 1u) {
            near = false;
            t += (f32(clear) - 1.0) * per_voxel;
            continue;
        }
        let u = side * level_of_spline(r, x + t * p).w;
        if (u <= 0.0) {
            if (!near) {
                return t;
            }
            return crossing_between(r, x, p, before, vec2<f32>(t, u), side);
        }
        before = vec2<f32>(t, u);
        near = true;
        if (t == range.y) {
            break;
        }
        t = min(t + SPACING * per_voxel, range.y);
    }
    return -1.0;
}

// The zero of ±φ between two samples (t, ±φ) of different sign: false position, with halved weights so that both ends move.
fn crossing_between(r: u32, x: vec3<f32>, p: vec3<f32>, first: vec2<f32>, second: vec2<f32>, side: f32) -> f32 {
    var a = first;
    var b = second;
    for (var k = 0; k < 8; k++) {
        let t = (a.x * b.y - b.x * a.y) / (b.y - a.y);
        let u = side * level_of_spline(r, x + t * p).w;
        if (u > 0.0) {
            a = vec2<f32>(t, u);
            b.y *= 0.5;
        } else {
            b = vec2<f32>(t, u);
            a.y *= 0.5;
        }
    }
    return b.x;
}

// The region that rules at a place, theory (2.23); −1 is vacuum.
fn ruling_at(x: vec3<f32>) -> i32 {
    for (var k = i32(view.regions) - 1; k >= 0; k--) {
        if ((regions[k].kind & IS_BODY) != 0u && level(u32(k), x).w < 0.0) {
            return k;
        }
    }
    return -1;
}

// Where a ray next meets something: t, the region (−1: nothing), and the side of its surface.
struct Meeting {
    t: f32,
    region: i32,
    side: f32,
}

// From outside of all regions.
fn next_region(x: vec3<f32>, p: vec3<f32>, from_t: f32) -> Meeting {
    var best = Meeting(FAR, -1, 1.0);
    for (var r = 0u; r < view.regions; r++) {
        let span = clip_region(r, x, p);
        let range = vec2<f32>(max(span.x, from_t), min(span.y, best.t));
        if (!(range.x < range.y)) {
            continue;
        }
        var t = range.x;
        if ((regions[r].kind & IS_BODY) != 0u) {
            t = first_crossing(r, x, p, range, 1.0);
        }
        if (t >= 0.0 && t < best.t) {
            best = Meeting(t, i32(r), 1.0);
        }
    }
    return best;
}

// From inside a body: its own surface, or that of a body that rules over it.
fn next_surface(within: u32, x: vec3<f32>, p: vec3<f32>, most: f32) -> Meeting {
    let behind = BEHIND / max_element(abs(p * regions[within].nodes_per_unit));
    var best = Meeting(most, -1, -1.0);
    let own = first_crossing(within, x, p, vec2<f32>(behind, min(most, clip_region(within, x, p).y)), -1.0);
    if (own >= 0.0) {
        best = Meeting(own, i32(within), -1.0);
    }
    for (var r = within + 1u; r < view.regions; r++) {
        let span = clip_region(r, x, p);
        let range = vec2<f32>(max(span.x, behind), min(span.y, best.t));
        if ((regions[r].kind & IS_BODY) == 0u || !(range.x < range.y)) {
            continue;
        }
        let t = first_crossing(r, x, p, range, 1.0);
        if (t >= 0.0) {
            best = Meeting(t, i32(r), 1.0);
        }
    }
    return best;
}

// What rules behind the surface of a body.
fn ruling_behind(surface: i32, enters: bool, x: vec3<f32>, p: vec3<f32>) -> i32 {
    var beyond = select(-1, surface, enters);
    for (var k = i32(view.regions) - 1; k > beyond; k--) {
        if (k == surface || (regions[k].kind & IS_BODY) == 0u) {
            continue;
        }
        let ahead = x + p * (BEHIND / max_element(abs(p * regions[k].nodes_per_unit)));
        if (level(u32(k), ahead).w < 0.0) {
            beyond = k;
        }
    }
    return beyond;
}

// Fresnel's reflectance, theory (7.1), by the normal momenta and w on both sides.
fn reflectance(a: f32, s: f32, w_before: f32, w_after: f32) -> f32 {
    let across = (a - s) / (a + s);
    let along = (w_after * a - w_before * s) / (w_after * a + w_before * s);
    return 0.5 * (across * across + along * along);
}
