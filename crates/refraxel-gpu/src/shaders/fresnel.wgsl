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
