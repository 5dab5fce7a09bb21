// Render rays that may bend, theory (3.9) along the segments of a path.

@compute @workgroup_size(WORKGROUP)
fn render_bent(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays) {
        return;
    }
    var tracer = Tracer();
    tracer.x = lessons[ray].origin;
    tracer.p = lessons[ray].direction;
    let bends = lessons[ray].bends != 0u;
    if (bends) {
        tracer = tracer_of(lessons[ray].origin, lessons[ray].direction);
    }
    var front = front_of(lessons[ray].offset);
    var colour = vec3<f32>(0.0);
    var depth = 0.0;
    // Length of the path before the segment.
    var arc = 0.0;
    var segment = Segment();
    while (!front.opaque) {
        if (bends) {
            if (!next_segment(&tracer, &segment)) {
                break;
            }
        } else {
            if (tracer.ended) {
                break;
            }
            note(&tracer, &segment, clip(tracer.x, tracer.p, task.near));
            tracer.ended = true;
        }
        let speed = length(segment.momentum);
        if (segment.range.x < segment.range.y) {
            var basis = basis_lanes(segment.momentum / speed);
            enter(&front, segment.start, segment.momentum, segment.range);
            var s: Sample;
            while (!front.opaque && next_sample(&front, &s)) {
                let weight = s.before * s.alpha;
                colour += weight * shade(s.corner, s.weight, &basis);
                depth += weight * (arc + speed * s.t);
            }
        }
        arc += speed * segment.range.y;
    }
    var behind = lessons[ray].behind;
    if ((task.wants & GIVEN_BEHIND) == 0u) {
        behind = background_radiance(normalize(tracer.p));
    }
    seen[ray] = Seen(colour + front.transmittance * behind, front.transmittance, behind, depth);
}
