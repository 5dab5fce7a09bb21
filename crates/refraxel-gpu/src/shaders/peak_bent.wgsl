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
    let bends = lessons[ray].bends != 0u;
    var tracer = path_of(ray);
    var front = front_of(lessons[ray].offset);
    var segment = Segment();
    while (!front.opaque && advance(&tracer, bends, &segment)) {
        if (!(segment.range.x < segment.range.y)) {
            continue;
        }
        enter(&front, segment.start, segment.momentum, segment.range);
        var s: Sample;
        while (!front.opaque && next_sample(&front, &s)) {
            weigh_sample(&s);
        }
    }
    if (is_cut_short()) {
        atomicOr(&status[STATUS_CUT], 1u);
    }
}
