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
    let bends = lessons[ray].bends != 0u;
    let keeps = (task.wants & WANTS_PATHS) != 0u;
    var tracer = path_of(ray);
    var front = front_of(lessons[ray].offset);
    var sight = Sight();
    var depth = 0.0;
    // Length of the path before the segment.
    var arc = 0.0;
    var segment = Segment();
    loop {
        if (keeps && tracer.segments % REPLAY == 0u && !tracer.ended) {
            keep(tracer.segments / REPLAY, ray, &tracer, &front, sight);
        }
        if (!advance(&tracer, bends, &segment)) {
            break;
        }
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
                depth += weight * (arc + speed * s.t);
            }
        }
        arc += speed * segment.range.y;
        sight.thickness += growth * segment.drift;
    }
    if (keeps) {
        keep(PATH_END, ray, &tracer, &front, sight);
    }
    var behind = lessons[ray].behind;
    if ((task.wants & GIVEN_BEHIND) == 0u) {
        behind = background_radiance(exit_of(ray, tracer.p));
    }
    let shown = through(filter_of(sight.thickness), behind);
    seen[ray] = Seen(sight.collected + front.transmittance * shown, front.transmittance, behind, depth);
    if (is_cut_short()) {
        atomicOr(&status[STATUS_CUT], 1u);
    }
}

// Keep where a path stands.
fn keep(row: u32, ray: u32, t: ptr<function, Tracer>, front: ptr<function, Front>, sight: Sight) {
    let at = place_of(row, ray);
    let visits = select((*t).visits, (*t).camera, (*t).segments == 0u);
    checkpoints[at] = Checkpoint(
        (*t).x, (*t).search_from, (*t).p, (*front).phase, sight.collected, (*front).transmittance,
        sight.thickness, (*t).events, (*t).body, visits, (*t).lattice, (*t).segments,
    );
}
