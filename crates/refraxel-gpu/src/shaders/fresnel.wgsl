// Fresnel's formulas, theory (7.1) and (7.3): `fresnel.rs` of the core.

// Normal momenta and w on both sides of an interface.
struct Incidence {
    before: f32,
    after: f32,
    w_before: f32,
    w_after: f32,
}

// Amplitudes r_s and r_p.
fn amplitudes(i: Incidence) -> vec2<f32> {
    let u = i.w_after * i.before;
    let v = i.w_before * i.after;
    return vec2<f32>((i.before - i.after) / (i.before + i.after), (u - v) / (u + v));
}

fn reflectance_of(i: Incidence) -> f32 {
    let r = amplitudes(i);
    return 0.5 * dot(r, r);
}

// The share of the light that is mirrored, by the rule of the medium.
fn share_of(i: Incidence) -> f32 {
    let whole = reflectance_of(i);
    return select(whole, min(whole * abs(i.after - i.before), 1.0), bending.plain_product != 0u);
}

// dLoss/d(incidence), whose four numbers count as independent.
fn reflectance_vjp(i: Incidence, d_reflectance: f32) -> Incidence {
    let r = amplitudes(i);
    // forward: r = (u − v) / (u + v), dr = 2 (v du − u dv) / (u + v)²
    let sum = i.before + i.after;
    let by_s = d_reflectance * r.x * 2.0 / (sum * sum);
    let u = i.w_after * i.before;
    let v = i.w_before * i.after;
    let by_p = d_reflectance * r.y * 2.0 / ((u + v) * (u + v));
    return Incidence(
        by_s * i.after + by_p * v * i.w_after,
        -by_s * i.before - by_p * u * i.w_before,
        -by_p * u * i.after,
        by_p * v * i.before,
    );
}

fn share_vjp(i: Incidence, d_share: f32) -> Incidence {
    let change = i.after - i.before;
    let is_product = bending.plain_product != 0u;
    let is_clamped = is_product && share_of(i) >= 1.0;
    let d_reflectance = select(d_share, select(d_share * abs(change), 0.0, is_clamped), is_product);
    var d = reflectance_vjp(i, d_reflectance);
    if (is_product && !is_clamped) {
        // forward: share = R |s − a|
        let d_change = d_share * reflectance_of(i) * select(-1.0, 1.0, change >= 0.0);
        d.after += d_change;
        d.before -= d_change;
    }
    return d;
}
