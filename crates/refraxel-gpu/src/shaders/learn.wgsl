// Compare rays with their targets, and the adjoint of the march, theory (3.10)–(3.14). `render` has run before: `seen` holds
// what the rays show. The march is repeated from the front; what lies behind a sample is what the ray shows less what it has
// collected so far, so that nothing is kept per sample.

@compute @workgroup_size(WORKGROUP)
fn learn(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays || lessons[ray].bends != 0u || lessons[ray].is_absent != 0u) {
        return;
    }
    let whole = seen[ray];
    let residual = whole.colour - lessons[ray].colour;
    let squared_error = dot(residual, residual);
    if (!is_finite(squared_error)) {
        atomicOr(&status[STATUS_LOSS], 1u);
        return;
    }
    add_status(STATUS_ERROR / 2u, squared_error);
    var d_colour = 2.0 * residual;
    var shown = whole.colour;
    if ((task.wants & COATED) != 0u && coats[ray].is_there != 0u) {
        // Behind the clearcoat.
        d_colour = coats[ray].d_behind;
        shown = coats[ray].behind;
    }
    let direction = lessons[ray].direction;
    if ((task.wants & GIVEN_BEHIND) == 0u) {
        scatter_background(direction, whole.transmittance * d_colour);
    }
    let sums = march_back(ray, shown, d_colour);
    if ((task.wants & WANTS_RAYS) != 0u) {
        var d_exit = vec3<f32>(0.0);
        if ((task.wants & GIVEN_BEHIND) == 0u) {
            let free = background_radiance_vjp(direction, d_colour * whole.transmittance);
            d_exit = free - direction * dot(direction, free);
        }
        ray_gradients[ray] = RayGradient(sums.start, 0.0, sums.momentum + d_exit, 0.0, residual, 0.0);
    }
}

// The adjoint of all samples of a straight ray; dLoss/d(segment).
fn march_back(ray: u32, shown: vec3<f32>, d_colour: vec3<f32>) -> SegmentAdjoint {
    var sums = SegmentAdjoint();
    let origin = lessons[ray].origin;
    let direction = lessons[ray].direction;
    var basis = basis_lanes(direction);
    var front = front_of(lessons[ray].offset);
    if (!enter_straight(&front, origin, direction)) {
        return sums;
    }
    var samples = 0u;
    var collected = vec3<f32>(0.0);
    var s: Sample;
    while (!front.opaque && next_sample(&front, &s)) {
        samples++;
        let colour = shade(s.corner, s.weight, &basis);
        let weight = s.before * s.alpha;
        collected += weight * colour;
        // forward: C = collected + T (1 − a) behind
        let after = s.before * (1.0 - s.alpha);
        let d_tau = dot(d_colour, after * colour - (shown - collected));
        // Its colour is drawn towards the target, theory (4.5).
        let drawn = d_colour + 2.0 * task.sample_colour * (colour - lessons[ray].colour);
        // A colour clamped at 0 has no slope.
        let d_sample = select(vec3<f32>(0.0), weight * drawn, colour > vec3<f32>(0.0));
        let d_theta = d_tau * s.slope;
        if ((task.wants & WANTS_FIELD) != 0u) {
            let share = near_share(s.t);
            scatter(&s, &basis, share * d_theta, share * d_sample);
        }
        if ((task.wants & WANTS_RAYS) != 0u) {
            add_segment_adjoint(&sums, &s, &basis, Teaching(origin, direction, 1.0, d_theta, d_tau, d_sample));
        }
    }
    atomicAdd(&status[STATUS_SAMPLES], samples);
    return sums;
}
