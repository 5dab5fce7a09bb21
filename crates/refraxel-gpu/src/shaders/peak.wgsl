// The largest weight T a that any straight ray gives to the samples around each voxel, theory (4.11).

@compute @workgroup_size(WORKGROUP)
fn peak(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays) {
        return;
    }
    var front = front_of(lessons[ray].offset);
    if (!enter_straight(&front, lessons[ray].origin, lessons[ray].direction)) {
        return;
    }
    var s: Sample;
    while (!front.opaque && next_sample(&front, &s)) {
        weigh_sample(&s);
    }
}
