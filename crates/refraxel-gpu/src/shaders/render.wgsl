// Render rays over the background, theory (3.9).

@compute @workgroup_size(WORKGROUP)
fn render(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays || lessons[ray].bends != 0u || lessons[ray].is_absent != 0u) {
        return;
    }
    let origin = lessons[ray].origin;
    let direction = lessons[ray].direction;
    var basis = basis_lanes(direction);
    var front = front_of(lessons[ray].offset);
    var colour = vec3<f32>(0.0);
    var depth = 0.0;
    if (enter_straight(&front, origin, direction)) {
        var s: Sample;
        while (!front.opaque && next_sample(&front, &s)) {
            let weight = s.before * s.alpha;
            colour += weight * shade(s.corner, s.weight, &basis);
            depth += weight * s.t;
        }
    }
    var behind = lessons[ray].behind;
    if ((task.wants & GIVEN_BEHIND) == 0u) {
        behind = background_radiance(direction);
    }
    seen[ray] = Seen(colour + front.transmittance * behind, front.transmittance, behind, depth);
}
