// What paths show with the light that surfaces mirror, theory (7.5): from the back, a section is composited over what is behind it,
// and a surface adds the light that it mirrors. `render_bent` has run before.

@compute @workgroup_size(WORKGROUP)
fn mirror(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = invocation(group, groups, lane);
    if (number >= bending.rays) {
        return;
    }
    let ray = bending.first + number;
    var colour = seen[ray].colour;
    var at = checkpoints[place_of(0u, ray)].mirror;
    while (is_surface(at)) {
        let r = reflections[at];
        let cache = read_by(r.within, r.region);
        var light = r.light;
        if ((task.wants & READS_CACHES) != 0u) {
            var stencil = probe_stencil(cache, r.position, r.direction);
            light = max(radiance_at(cache, &stencil), vec3<f32>(0.0));
            reflections[at].light = light;
        }
        reflections[at].behind = colour;
        let share = caches[2u * r.region].strength * r.reflectance;
        colour = r.collected + r.through * mixed(share, through(filter_of(r.thickness), light), colour);
        at = r.previous;
    }
    seen[ray].colour = colour;
    if (is_cut_short()) {
        atomicOr(&status[STATUS_CUT], 1u);
    }
}
