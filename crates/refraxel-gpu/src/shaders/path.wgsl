// The paths of rays from one dispatch to the next, and what is seen along them.

// What a path has seen so far. Surfaces that mirror cut it into sections: the radiance of one and its transmittance count from its
// start, for a transmittance of 1 before it.
struct Sight {
    collected: vec3<f32>,
    depth: f32,
    thickness: vec3<f32>,
    arc: f32,
    through: f32,
    // The reflection before the section; before the first one, the head of the list.
    mirror: u32,
}

// Before the first segment of a path.
fn first_sight(ray: u32) -> Sight {
    return Sight(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), 0.0, 1.0, ray - bending.first);
}

fn sight_at(c: Checkpoint) -> Sight {
    return Sight(c.collected, c.depth, c.thickness, c.arc, c.through, c.mirror);
}

// Whether the path of a ray is followed. Where there is a clearcoat, the kernels for straight rays have those that do not bend.
fn is_followed(ray: u32) -> bool {
    return lessons[ray].is_absent == 0u && ((task.wants & COATED) == 0u || lessons[ray].bends != 0u);
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
    front.due = c.due;
    front.opaque = c.transmittance < task.min_transmittance;
    return front;
}

fn checkpoint_of(t: ptr<function, Tracer>, front: ptr<function, Front>, sight: Sight, stage: u32) -> Checkpoint {
    let visits = select((*t).visits, (*t).camera, (*t).segments == 0u);
    return Checkpoint(
        (*t).x, (*t).search_from, (*t).p, (*front).phase, sight.collected, (*front).transmittance, sight.thickness,
        (*t).events, (*t).body, visits, (*t).lattice, (*t).segments, sight.depth, sight.arc, stage,
        sight.through, sight.mirror, (*front).due, 0u, 0u,
    );
}
