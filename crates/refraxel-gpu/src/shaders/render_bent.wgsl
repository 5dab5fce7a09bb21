// Render rays that may bend, theory (3.9) along the segments of a path, and keep what their adjoint begins with. Where surfaces
// mirror, `find_reflections` has run before, and `mirror` follows: `seen` holds what is seen behind the last of them.

// Begin a section behind each surface that mirrors where these first segments of the path end. Behind what is opaque nothing is.
fn cut(sight: ptr<function, Sight>, front: ptr<function, Front>, segments: u32) {
    var next = next_reflection((*sight).mirror, segments);
    while (next != 0u && !(*front).opaque) {
        reflections[next].collected = (*sight).collected;
        reflections[next].through = (*sight).through;
        reflections[next].thickness = (*sight).thickness;
        reflections[next].reached = (*front).transmittance;
        (*sight).collected = vec3<f32>(0.0);
        (*sight).through = 1.0;
        (*sight).mirror = next;
        next = next_reflection(next, segments);
    }
}

@compute @workgroup_size(WORKGROUP)
fn render_bent(
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
    if ((task.wants & WANTS_PATHS) != 0u) {
        checkpoints[place_of(1u + c.segments / bending.replay, ray)] = c;
    }
    let bends = lessons[ray].bends != 0u;
    let follows = is_followed(ray);
    var tracer = tracer_at(c);
    var front = front_at(c);
    var sight = sight_at(c);
    var segment = Segment();
    var count = 0u;
    while (follows && count < bending.replay && advance(&tracer, bends, &segment)) {
        count++;
        let speed = length(segment.momentum);
        let growth = thickness_growth(segment.within, speed);
        if (!front.opaque && segment.range.x < segment.range.y) {
            var basis = basis_lanes(segment.momentum / speed);
            enter(&front, segment.start, segment.momentum, segment.range);
            var s: Sample;
            while (!front.opaque && next_sample(&front, &s)) {
                let filter_there = filter_of(sight.thickness + growth * s.t);
                sight.collected += sight.through * s.alpha * through(filter_there, shade(s.corner, s.weight, &basis));
                sight.through *= 1.0 - s.alpha;
                sight.depth += s.before * s.alpha * (sight.arc + speed * s.t);
            }
        }
        sight.arc += speed * segment.range.y;
        sight.thickness += growth * segment.drift;
        cut(&sight, &front, tracer.segments);
    }
    if (!stand(ray, &tracer, &front, sight, count < bending.replay) || !follows) {
        return;
    }
    var behind = lessons[ray].behind;
    if ((task.wants & GIVEN_BEHIND) == 0u) {
        behind = background_radiance(exit_of(ray, tracer.p));
    }
    let shown = through(filter_of(sight.thickness), behind);
    seen[ray] = Seen(sight.collected + sight.through * shown, front.transmittance, behind, sight.depth);
}
