// Where a line leaves the side of a surface that it is on, theory (2.24): `crossing.rs` of the core.

// φ along x + t p, counted positive on the side of the ray.
struct Line {
    region: u32,
    // +1 outside, −1 inside.
    side: f32,
    // Node coordinates at t = 0, and their derivative by t.
    start: vec3<f32>,
    velocity: vec3<f32>,
}

// ±φ at a point of a line, and its slope.
struct LinePoint {
    t: f32,
    u: f32,
    slope: f32,
}

// Of the spline.
fn line_point(line: Line, t: f32) -> LinePoint {
    return counted(line, t, spline_sample_at(line.region, line.start + line.velocity * t));
}

fn counted(line: Line, t: f32, phi: vec4<f32>) -> LinePoint {
    return LinePoint(t, line.side * phi.w, line.side * dot(phi.xyz, line.velocity));
}

// What stands on the surface at t, or by rounding beyond it, and goes on beyond has crossed it.
fn goes_beyond(line: Line, t: f32) -> bool {
    let start = counted(line, t, level_sample_at(line.region, line.start + line.velocity * t));
    return start.u <= 0.0 && start.slope < 0.0;
}

// The first t in [from, end] at which the line x + t p leaves its side of the surface of a body; FAR if it stays.
fn first_crossing(region: u32, x: vec3<f32>, p: vec3<f32>, range: vec2<f32>, side: f32) -> f32 {
    let l = 2u * region + 1u;
    let line = Line(region, side, lattice_node(l, x), p * lattices[l].scale);
    if (regions[region].planes == 0u) {
        return crossing_of_spline(line, x, p, range);
    }
    if (goes_beyond(line, range.x)) {
        return range.x;
    }
    let below = below_facets(line);
    var found = FAR;
    var searched = range;
    if (side < 0.0) {
        found = select(range.x, max(range.x, below.y), below.x < below.y);
        searched.y = min(found, range.y);
    } else {
        // Nothing comes back below a plane that it has left, or is about to leave.
        let nudge = NUDGE / max_element(abs(line.velocity));
        let leaves = regions[region].body == BODY && below.y <= range.x + nudge;
        if (below.x >= below.y || below.x > range.y || leaves) {
            return FAR;
        }
        let is_below_spline = regions[region].body == BODY_OF_PLANES || line_point(line, below.x).u <= 0.0;
        if (below.x >= range.x && is_below_spline) {
            return below.x;
        }
        searched = vec2<f32>(max(below.x, range.x), min(below.y, range.y));
    }
    if (regions[region].body == BODY) {
        let spline = crossing_of_spline(line, x, p, searched);
        if (spline != FAR) {
            return spline;
        }
    }
    return select(FAR, found, found <= range.y);
}

// Where a line is below all planes of a body: between these two, or nowhere.
fn below_facets(line: Line) -> vec2<f32> {
    var below = vec2<f32>(-FAR, FAR);
    for (var k = 0u; k < regions[line.region].planes; k++) {
        let plane = facet(line.region, k);
        below = clip_plane(below, plane.w + dot(plane.xyz, line.start), dot(plane.xyz, line.velocity));
    }
    return below;
}

// The first crossing of the spline of a body.
fn crossing_of_spline(line: Line, x: vec3<f32>, p: vec3<f32>, range: vec2<f32>) -> f32 {
    let l = 2u * line.region + 1u;
    let per_voxel = 1.0 / max_element(abs(line.velocity));
    let spacing = CROSSING_SPACING * per_voxel;
    let nudge = NUDGE * per_voxel;
    var t = range.x;
    var a = LinePoint();
    var searches = false;
    while (t <= range.y) {
        if (!searches) {
            let marked = first_marked(l, x, p, t, range.y);
            if (marked == FAR) {
                return FAR;
            }
            // A hop ends a little inside the cell: begin a little before it.
            a = line_point(line, select(t, max(t, marked - 2.0 * nudge), marked > t));
            searches = true;
        }
        let b = line_point(line, min(a.t + spacing, range.y));
        let found = crossing_between(line, a, b);
        if (found != FAR) {
            return found;
        }
        if (b.t >= range.y) {
            return FAR;
        }
        a = b;
        t = a.t;
        searches = clearance_at(l, line.start + line.velocity * t) == 0u;
    }
    return FAR;
}

// The t between two neighbouring points at which the line leaves its side; FAR if it stays.
fn crossing_between(line: Line, a: LinePoint, b: LinePoint) -> f32 {
    if (a.u <= 0.0 && a.slope <= 0.0) {
        return a.t;
    }
    // A ray that left the surface crosses it where u comes back to the value at which it began.
    let base = min(a.u, 0.0);
    var high = b;
    if (b.u > base) {
        if (!(a.slope < 0.0 && b.slope > 0.0)) {
            return FAR;
        }
        high = line_point(line, lowest_between(a, b));
        if (high.u > base) {
            return FAR;
        }
    }
    return root(line, a, high, base);
}

// Where u falls to `base`: Newton's method within a bracket, bisection where a Newton step would leave it.
fn root(line: Line, a: LinePoint, b: LinePoint, base: f32) -> f32 {
    var low = a;
    var high = b;
    for (var k = 0u; k < CROSSING_STEPS && low.u <= base; k++) {
        let middle = line_point(line, a.t + (high.t - a.t) * 0.5);
        if (middle.u > base) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let across = f32(max(lattices[2u * line.region + 1u].nodes.x,
        max(lattices[2u * line.region + 1u].nodes.y, lattices[2u * line.region + 1u].nodes.z)));
    let tolerance = EPSILON * (b.t + across / max_element(abs(line.velocity)));
    var t = low.t + (high.t - low.t) * min((low.u - base) / (low.u - high.u), 1.0);
    for (var k = 0u; k < CROSSING_STEPS; k++) {
        let m = line_point(line, t);
        if (m.u > base) {
            low = m;
        } else {
            high = m;
        }
        let newton = t - (m.u - base) / m.slope;
        let next = select(low.t + (high.t - low.t) * 0.5, newton, newton >= low.t && newton <= high.t);
        if (abs(next - t) <= tolerance || high.t - low.t <= tolerance) {
            return next;
        }
        t = next;
    }
    return t;
}

// Where the cubic through values and slopes at both ends, falling at a and rising at b, is lowest.
fn lowest_between(a: LinePoint, b: LinePoint) -> f32 {
    let len = b.t - a.t;
    let d0 = a.slope * len;
    let d1 = b.slope * len;
    let rise = b.u - a.u;
    let quadratic = 3.0 * rise - 2.0 * d0 - d1;
    let cubic = d0 + d1 - 2.0 * rise;
    let s = -d0 / (quadratic + sqrt(max(quadratic * quadratic - 3.0 * cubic * d0, 0.0)));
    return a.t + len * clamp(s, 0.0, 1.0);
}
