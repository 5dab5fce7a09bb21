// The adjoint of a clearcoat up to the surface at which a ray ends, theory (7.6), (7.8) and (7.15): what its probes receive, and what
// `learn` and `learn_coat` begin with.

@compute @workgroup_size(WORKGROUP)
fn coat_vjp(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays || coats[ray].is_there == 0u) {
        return;
    }
    let d_shown = 2.0 * (seen[ray].colour - lessons[ray].colour);
    if (!is_finite(dot(d_shown, d_shown))) {
        return;
    }
    let c = coats[ray];
    // forward: shown = mixed(ρ share, light, behind)
    let d = mixed_vjp(c.strength * c.share, c.light, c.behind, d_shown);
    coats[ray].d_behind = d.behind;
    // Nothing where the strength is clamped at 1.
    let d_strength = select(0.0, d.share * c.share, c.strength < 1.0);
    var lookup = radiance_vjp(STRENGTH, c.position, UP, vec3<f32>(d_strength, 0.0, 0.0));
    lookup.direction = vec3<f32>(0.0);
    if ((task.wants & READS_CACHES) != 0u) {
        let of_light = radiance_vjp(RADIANCE, c.position, c.direction, d.mirrored);
        lookup = LookupAdjoint(lookup.position + of_light.position, of_light.direction);
    }
    coats[ray].d_position = lookup.position;
    reflect_on_vjp(ray, c, d.share * c.strength, lookup.direction);
}

// Transpose of `reflect_on` by the surface, theory (7.15).
fn reflect_on_vjp(ray: u32, c: Coat, d_share: f32, d_direction: vec3<f32>) {
    let direction = lessons[ray].direction;
    let square = dot(c.slope, c.slope);
    let cosine = -dot(direction, c.normal);
    let steep = saturation(square, LEAST_SLOPE);
    let oblique = saturation(cosine * cosine, LEAST_COSINE);
    let at = incidence_of(cosine);
    let reflectance = reflectance_of(at);
    // forward: share = A steep(G²) oblique(a²) R(a)
    let d_at = reflectance_vjp(at, d_share * c.opacity * steep.x * oblique.x);
    // forward: after² = n² − 1 + before²
    var d_cosine = d_at.before + d_at.after * cosine / at.after;
    d_cosine += d_share * c.opacity * steep.x * reflectance * oblique.y * 2.0 * cosine;
    // forward: u = d + 2 a m
    d_cosine += 2.0 * dot(c.normal, d_direction);
    // forward: a = −d · m
    let d_normal = d_direction * (2.0 * cosine) - direction * d_cosine;
    // forward: m = G/|G|
    let d_square = d_share * c.opacity * oblique.x * reflectance * steep.y;
    coats[ray].d_slope = (d_normal - c.normal * dot(c.normal, d_normal)) / sqrt(square) + c.slope * (2.0 * d_square);
    coats[ray].d_opacity = d_share * steep.x * oblique.x * reflectance;
}
