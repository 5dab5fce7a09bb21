// The largest weight of the samples around each voxel, theory (4.11), along paths.

@compute @workgroup_size(WORKGROUP)
fn peak_bent(
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
    var segment = Segment();
    var count = 0u;
    while (count < bending.replay && !front.opaque && advance(&tracer, bends, &segment)) {
        count++;
        if (!(segment.range.x < segment.range.y)) {
            continue;
        }
        enter(&front, segment.start, segment.momentum, segment.range);
        var s: Sample;
        while (!front.opaque && next_sample(&front, &s)) {
            weigh_sample(&s);
        }
    }
    stand(ray, &tracer, &front, Sight(), front.opaque || count < bending.replay);
}
