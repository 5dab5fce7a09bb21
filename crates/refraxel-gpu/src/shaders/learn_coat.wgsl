// The way back from the surface at which a straight ray ends to its samples, theory (7.15) and (7.16), as one more channel of colour
// before black. `learn` has done the rest.

@compute @workgroup_size(WORKGROUP)
fn learn_coat(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays || coats[ray].is_there == 0u) {
        return;
    }
    let c = coats[ray];
    let origin = lessons[ray].origin;
    let direction = lessons[ray].direction;
    var front = front_of(lessons[ray].offset);
    if (!enter_straight(&front, origin, direction)) {
        return;
    }
    let wants_rays = (task.wants & WANTS_RAYS) != 0u;
    var d_origin = vec3<f32>(0.0);
    var d_direction = vec3<f32>(0.0);
    // Σ w dLoss/dw over all samples: the mean of x − X is 0.
    let whole = c.d_opacity * c.opacity + dot(c.d_slope, c.slope);
    var collected = 0.0;
    var s: Sample;
    while (!front.opaque && next_sample(&front, &s)) {
        let x = origin + direction * s.t;
        let weight = s.before * s.alpha;
        let counts = weight > bending.least_weight;
        var d_weight = 0.0;
        if (counts) {
            let slope = density_slope(&s, x);
            d_weight = c.d_opacity + dot(c.d_position, x - c.position) / c.opacity - dot(c.d_slope, slope);
        }
        collected += weight * d_weight;
        let d_tau = s.before * (1.0 - s.alpha) * d_weight - (whole - collected);
        let d_theta = d_tau * s.slope;
        if ((task.wants & WANTS_FIELD) != 0u) {
            // forward: G = −h Σ w ∇θ
            let d_node = node_jvp(x, c.d_slope * select(0.0, -weight * scene.voxel, counts));
            scatter_density(&s, near_share(s.t) * d_theta, d_node);
        }
        if (wants_rays) {
            let d_x = node_vjp(x, trilinear_gradient(s.fraction, densities(&s)) * d_theta);
            d_origin += d_x;
            d_direction += d_x * s.t + direction * (d_tau * s.tau);
        }
    }
    if (wants_rays) {
        ray_gradients[ray].origin += d_origin;
        ray_gradients[ray].direction += d_direction;
    }
}
