// The adjoint of what surfaces mirror, from the front, theory (7.3), (7.4), (7.6), (7.8), (7.11) and (7.12): what caches, strengths
// and smooth transitions receive, what the sections of paths are blamed for, and what `learn_bent` hands to paths and surfaces.

@compute @workgroup_size(WORKGROUP)
fn mirror_vjp(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = invocation(group, groups, lane);
    if (number >= bending.rays) {
        return;
    }
    let ray = bending.first + number;
    let end = checkpoints[place_of(0u, ray)];
    var d_seen = d_colour_of(ray, end);
    if (!is_surface(end.mirror) || !is_finite(dot(d_seen, d_seen))) {
        return;
    }
    choose_what_learns(ray, end);
    var at = number;
    while (at != end.mirror) {
        at = reflections[at].next;
        d_seen = look_back(at, d_seen);
        scatter_samples();
    }
    if (is_cut_short()) {
        atomicOr(&status[STATUS_CUT], 1u);
    }
}

// The adjoint of one surface given dLoss/d(what it shows) for a transmittance of 1 before the path; dLoss/d(what is behind it).
fn look_back(at: u32, d_shown: vec3<f32>) -> vec3<f32> {
    let r = reflections[at];
    let strength = caches[2u * r.region].strength;
    let f = filtered(filter_of(r.thickness), r.light);
    let d = mixed_vjp(strength * r.reflectance, f.colour, r.behind, d_shown);
    let d_filtered = r.reached * d.mirrored;
    let d_share = r.reached * d.share;
    add_probe_gradient(bending.strengths_from + r.region, d_share * r.reflectance);
    var lookup = LookupAdjoint();
    if ((task.wants & READS_CACHES) != 0u) {
        lookup = radiance_vjp(read_by(r.within, r.region), r.position, r.direction, d_filtered * f.slope);
    }
    reflections[at].d_behind = d.behind;
    reflections[at].d_thickness = d_filtered * f.by_thickness;
    let by = reflectance_vjp(Incidence(abs(r.before), abs(r.after), r.w_before, r.w_after), d_share * strength);
    if (r.trend == SHARP) {
        reflection_vjp(at, r, by, lookup);
    } else {
        passage_vjp(at, r, by, lookup);
    }
    return d.behind;
}

// At a sharp surface, theory (7.4).
fn reflection_vjp(at: u32, r: Reflection, by: Incidence, d: LookupAdjoint) {
    // forward: u = q/|q|, q = p − 2 a m
    let size = length(r.p - r.normal * (2.0 * r.before));
    let d_q = (d.direction - r.direction * dot(r.direction, d.direction)) / size;
    reflections[at].d_position = d.position;
    reflections[at].d_p = d_q;
    reflections[at].d_before = select(-by.before, by.before, r.before >= 0.0) - 2.0 * dot(r.normal, d_q);
    reflections[at].d_after = select(-by.after, by.after, r.after >= 0.0);
    reflections[at].d_w_before = by.w_before;
    reflections[at].d_w_after = by.w_after;
}

// At a smooth transition, theory (7.12). Which points it has is held fixed.
fn passage_vjp(at: u32, r: Reflection, by: Incidence, d: LookupAdjoint) {
    let m = -r.normal;
    let along = dot(r.p, m);
    let turned = select(-r.before, r.before, r.trend == RISES);
    // forward: u = q/|q|, q = p − (p·m) m ∓ a m
    let size = length(r.p - m * (along + turned));
    let d_q = (d.direction - r.direction * dot(r.direction, d.direction)) / size;
    // forward: a² = 2 w₀ − t, s² = 2 w₁ − t, t = p² − (p·m)²
    let by_before = (by.before - select(-1.0, 1.0, r.trend == RISES) * dot(m, d_q)) / r.before;
    let by_after = by.after / r.after;
    let d_t = -0.5 * (by_before + by_after);
    let d_m = -d_q * (along + turned) - r.p * (dot(m, d_q) + 2.0 * along * d_t);
    // forward: m = ∇w/|∇w|
    let d_force = (d_m - m * dot(m, d_m)) / r.slope;
    add_index_sample(r.region, r.position, 0.0, d_force);
    reflections[at].d_position = d.position + gradient_pullback(r.region, r.position, d_force);
    reflections[at].d_p = d_q - m * dot(m, d_q) + (r.p - m * along) * (2.0 * d_t);
    reflections[at].d_first = point_vjp(r.first_region, r.first, by.w_before + by_before);
    reflections[at].d_last = point_vjp(r.last_region, r.last, by.w_after + by_after);
}

// Transpose of w at a point: dLoss/d(place); nothing outside smooth regions.
fn point_vjp(region: u32, x: vec3<f32>, d_w: f32) -> vec3<f32> {
    if (region == NO_REGION) {
        return vec3<f32>(0.0);
    }
    add_index_sample(region, x, d_w, vec3<f32>(0.0));
    return w_gradient(region, x) * d_w;
}
