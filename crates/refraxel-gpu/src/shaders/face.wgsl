// The surface at which a straight ray ends, theory (7.13), and the share of light that its clearcoat mirrors, theory (7.14):
// `facing.rs` of the core.

@compute @workgroup_size(WORKGROUP)
fn face(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays) {
        return;
    }
    var coat = Coat();
    let origin = lessons[ray].origin;
    let direction = lessons[ray].direction;
    var front = front_of(lessons[ray].offset);
    let is_straight = lessons[ray].bends == 0u && lessons[ray].is_absent == 0u;
    if (is_straight && enter_straight(&front, origin, direction)) {
        var s: Sample;
        while (!front.opaque && next_sample(&front, &s)) {
            let weight = s.before * s.alpha;
            if (weight > bending.least_weight) {
                let x = origin + direction * s.t;
                coat.opacity += weight;
                coat.position += weight * x;
                coat.slope -= weight * density_slope(&s, x);
            }
        }
    }
    reflect_on(&coat, direction);
    coats[ray] = coat;
}

// The reflection of a ray; none where the surface faces away or has no normal.
fn reflect_on(coat: ptr<function, Coat>, direction: vec3<f32>) {
    let square = dot((*coat).slope, (*coat).slope);
    if (!((*coat).opacity > 0.0) || !(square > 0.0)) {
        return;
    }
    (*coat).position /= (*coat).opacity;
    (*coat).normal = (*coat).slope / sqrt(square);
    let cosine = -dot(direction, (*coat).normal);
    if (!(cosine > 0.0)) {
        return;
    }
    let steep = saturation(square, LEAST_SLOPE).x * saturation(cosine * cosine, LEAST_COSINE).x;
    (*coat).share = (*coat).opacity * steep * reflectance_of(incidence_of(cosine));
    (*coat).direction = direction + (*coat).normal * (2.0 * cosine);
    (*coat).is_there = 1u;
}
