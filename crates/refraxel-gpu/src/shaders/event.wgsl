// A ray at a sharp surface, theory (2.25) and (2.26): `event.rs` of the core.

// A ray on a surface, after the end kick and before the event.
struct Arrival {
    p: vec3<f32>,
    // a = p · m and s = p' · m, with their signs.
    before: f32,
    // m = ∇φ/|∇φ|.
    normal: vec3<f32>,
    after: f32,
    // w on both sides.
    w_before: f32,
    w_after: f32,
}

// Position and momentum behind a surface, what rules on its other side, and whether the ray passes.
struct Turned {
    x: vec3<f32>,
    p: vec3<f32>,
    beyond: u32,
    passes: bool,
    arrival: Arrival,
}

// The event at the end of a drift of length tau from x with momentum p inside of `within`, on the surface of `body`; `late` is
// the length of the end kick.
fn turned_at(x0: vec3<f32>, p0: vec3<f32>, tau: f32, body: u32, from_inside: bool, within: u32, late: f32) -> Turned {
    let x = x0 + p0 * tau;
    let beyond = ruling_behind(body, !from_inside, x, p0);
    let before_field = field_sample(within, x);
    let p = p0 + before_field.xyz * late;
    let normal = normalize(level_sample(body, x).xyz);
    // p' = p + (s − a) m, theory (2.25).
    let a = dot(p, normal);
    let w_after = field_sample(beyond, x).w;
    let square = a * a + (2.0 * w_after - 2.0 * before_field.w);
    let passes = square > 0.0;
    let size = select(-abs(a), sqrt(max(square, 0.0)), passes);
    let s = select(-size, size, from_inside);
    let arrival = Arrival(p, a, normal, s, before_field.w, w_after);
    return Turned(x, p + normal * (s - a), beyond, passes, arrival);
}
