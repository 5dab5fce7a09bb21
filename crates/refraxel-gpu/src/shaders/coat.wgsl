// What straight rays show with what a clearcoat mirrors, theory (7.5) and (7.7).

@compute @workgroup_size(WORKGROUP)
fn coat(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays || coats[ray].is_there == 0u) {
        return;
    }
    let position = coats[ray].position;
    var light = coats[ray].light;
    if ((task.wants & READS_CACHES) != 0u) {
        var stencil = probe_stencil(RADIANCE, position, coats[ray].direction);
        light = max(radiance_at(RADIANCE, &stencil), vec3<f32>(0.0));
        coats[ray].light = light;
    }
    var stencil = probe_stencil(STRENGTH, position, UP);
    let strength = clamp(radiance_at(STRENGTH, &stencil).x, 0.0, 1.0);
    coats[ray].strength = strength;
    coats[ray].behind = seen[ray].colour;
    seen[ray].colour = mixed(strength * coats[ray].share, light, seen[ray].colour);
}
