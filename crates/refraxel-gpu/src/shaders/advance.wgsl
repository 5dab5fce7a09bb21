// The paths of rays, bent or straight.

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
