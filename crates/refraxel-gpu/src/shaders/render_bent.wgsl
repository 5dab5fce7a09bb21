// Render rays that may bend, theory (3.9) along the segments of a path, and keep what their adjoint begins with.

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
    var tracer = tracer_at(c);
    var front = front_at(c);
    var sight = Sight(c.collected, c.depth, c.thickness, c.arc);
    var segment = Segment();
    var count = 0u;
    while (count < bending.replay && advance(&tracer, bends, &segment)) {
        count++;
        let speed = length(segment.momentum);
        let growth = thickness_growth(segment.within, speed);
        if (!front.opaque && segment.range.x < segment.range.y) {
            var basis = basis_lanes(segment.momentum / speed);
            enter(&front, segment.start, segment.momentum, segment.range);
            var s: Sample;
            while (!front.opaque && next_sample(&front, &s)) {
                let weight = s.before * s.alpha;
                let filter_there = filter_of(sight.thickness + growth * s.t);
                sight.collected += weight * through(filter_there, shade(s.corner, s.weight, &basis));
                sight.depth += weight * (sight.arc + speed * s.t);
            }
        }
        sight.arc += speed * segment.range.y;
        sight.thickness += growth * segment.drift;
    }
    if (!stand(ray, &tracer, &front, sight, count < bending.replay)) {
        return;
    }
    var behind = lessons[ray].behind;
    if ((task.wants & GIVEN_BEHIND) == 0u) {
        behind = background_radiance(exit_of(ray, tracer.p));
    }
    let shown = through(filter_of(sight.thickness), behind);
    seen[ray] = Seen(sight.collected + front.transmittance * shown, front.transmittance, behind, sight.depth);
}
