// The partial reflections on a path, at sharp surfaces and smooth transitions, theory (7.1), (7.2) and (7.11), in the order in which
// the ray meets them: `partial_reflections.rs` and `transition.rs` of the core. Paths are traced without a look at the field: where
// a transition is steepest is known only behind it.

// A point of a path, which is the start of a segment.
struct Point {
    x: vec3<f32>,
    w: f32,
    // Momentum of the segment, and that with which the ray arrives.
    p: vec3<f32>,
    segment: u32,
    arriving: vec3<f32>,
    // The smooth region that is marched through, or NO_REGION.
    region: u32,
    force: vec3<f32>,
    padding_0: u32,
}

// A run of points over which w RISES or FALLS; SHARP where it does neither. And the last point of all.
struct Passing {
    first: Point,
    steepest: Point,
    last: Point,
    before: Point,
    trend: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

@compute @workgroup_size(WORKGROUP)
fn find_reflections(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = invocation(group, groups, lane);
    if (number >= bending.rays) {
        return;
    }
    let ray = bending.first + number;
    let c = standing(ray);
    if (c.stage == OVER) {
        return;
    }
    let bends = lessons[ray].bends != 0u;
    var tracer = tracer_at(c);
    var front = front_at(c);
    var sight = sight_at(c);
    var passing = Passing();
    if (c.segments > 0u && bending.is_smooth != 0u) {
        passing = passings[number];
    }
    var segment = Segment();
    var count = 0u;
    loop {
        let p = tracer.p;
        if (count >= bending.replay || !advance(&tracer, bends, &segment)) {
            break;
        }
        count++;
        let last = tracer.segments - 1u;
        if (bending.is_smooth != 0u) {
            pass_point(&passing, point_of(&segment, last, p, passing.before), &sight);
        }
        if ((segment.event & REFRACTS) != 0u) {
            push(at_event(&segment, last), &sight);
        }
    }
    if (bending.is_smooth != 0u) {
        passings[number] = passing;
    }
    stand(ray, &tracer, &front, sight, count < bending.replay);
}

// Append a reflection to the list of the path. What finds no room is counted, too: the host begins again with more.
fn push(found: Reflection, sight: ptr<function, Sight>) {
    let at = atomicAdd(&status[STATUS_REFLECTIONS], 1u);
    if (at >= arrayLength(&reflections)) {
        return;
    }
    var r = found;
    r.previous = (*sight).mirror;
    reflections[at] = r;
    reflections[(*sight).mirror].next = at;
    (*sight).mirror = at;
}

// The partial reflection at the sharp surface at the end of a segment, theory (7.1) and (7.2).
fn at_event(segment: ptr<function, Segment>, number: u32) -> Reflection {
    var r = Reflection();
    let arrival = (*segment).arrival;
    r.segment = number;
    r.position = (*segment).start + (*segment).momentum * (*segment).drift;
    r.normal = arrival.normal;
    r.region = (*segment).surface;
    r.within = (*segment).within;
    r.p = arrival.p;
    r.before = arrival.before;
    r.after = arrival.after;
    r.w_before = arrival.w_before;
    r.w_after = arrival.w_after;
    r.direction = normalize(r.p - r.normal * (2.0 * r.before));
    r.reflectance = reflectance_of(Incidence(abs(r.before), abs(r.after), r.w_before, r.w_after));
    r.trend = SHARP;
    return r;
}

// The point at the start of a segment before which the momentum was `p`.
fn point_of(segment: ptr<function, Segment>, number: u32, p: vec3<f32>, before: Point) -> Point {
    let within = (*segment).within;
    let is_hop = (*segment).lattice == 0u;
    var point = Point();
    point.x = (*segment).start;
    point.p = (*segment).momentum;
    point.segment = number;
    // The momentum of a hop is that with which it arrives.
    point.arriving = select(before.p, point.p, is_hop || number == 0u);
    point.region = NO_REGION;
    // The camera may stand anywhere.
    point.w = select(VACUUM, 0.5 * dot(p, p), number == 0u);
    if (!is_hop && within != NO_REGION && regions[within].body == NO_BODY) {
        point.region = within;
        point.w = (*segment).field.w;
        point.force = (*segment).field.xyz;
    }
    return point;
}

// Take the next point of a path to the run of points, or end that and begin another.
fn pass_point(passing: ptr<function, Passing>, point: Point, sight: ptr<function, Sight>) {
    let change = point.w - (*passing).before.w;
    let is_flat = point.segment == 0u || !(abs(change) > PASSAGE_FLAT);
    let trend = select(select(FALLS, RISES, change > 0.0), SHARP, is_flat);
    let goes_on = trend != SHARP && trend == (*passing).trend;
    if (!goes_on) {
        close(passing, sight);
        (*passing).trend = trend;
        (*passing).first = (*passing).before;
        (*passing).steepest = (*passing).before;
    }
    (*passing).last = point;
    if (dot(point.force, point.force) > dot((*passing).steepest.force, (*passing).steepest.force)) {
        (*passing).steepest = point;
    }
    if (point.region == NO_REGION) {
        close(passing, sight);
        (*passing).trend = SHARP;
    }
    (*passing).before = point;
}

// Note the reflection of a run of points that has ended, theory (7.11): none where the ray turns round, at grazing incidence, for
// lenses, and below the least reflectance.
fn close(passing: ptr<function, Passing>, sight: ptr<function, Sight>) {
    let at = (*passing).steepest;
    let slope = length(at.force);
    if ((*passing).trend == SHARP || at.region == NO_REGION || at.segment == 0u || !(slope > 0.0)) {
        return;
    }
    if (slope < regions[at.region].gentlest) {
        return;
    }
    let m = at.force / slope;
    let rises = (*passing).trend == RISES;
    let along = dot(at.p, m);
    let towards = vec3<f32>(dot((*passing).first.arriving, m), along, dot((*passing).last.p, m));
    if (any((towards > vec3<f32>(0.0)) != vec3<bool>(rises))) {
        return;
    }
    let w = vec2<f32>((*passing).first.w, (*passing).last.w);
    let square = 2.0 * w - (dot(at.p, at.p) - along * along);
    if (!all(square > (2.0 * GRAZING * GRAZING) * w)) {
        return;
    }
    let incidence = Incidence(sqrt(square.x), sqrt(square.y), w.x, w.y);
    if (!(reflectance_of(incidence) > PASSAGE_LEAST)) {
        return;
    }
    var r = Reflection();
    r.position = at.x;
    r.segment = at.segment - 1u;
    r.normal = -m;
    r.region = at.region;
    r.within = select(NO_REGION, at.region, w.x > VACUUM + PASSAGE_INSIDE);
    r.p = at.p;
    r.before = incidence.before;
    r.after = incidence.after;
    r.w_before = w.x;
    r.w_after = w.y;
    r.direction = normalize(at.p - m * (along + select(-incidence.before, incidence.before, rises)));
    r.reflectance = reflectance_of(incidence);
    r.first = (*passing).first.x;
    r.first_segment = (*passing).first.segment;
    r.first_region = (*passing).first.region;
    r.last = (*passing).last.x;
    r.last_segment = (*passing).last.segment;
    r.last_region = (*passing).last.region;
    r.slope = slope;
    r.trend = (*passing).trend;
    push(r, sight);
}
