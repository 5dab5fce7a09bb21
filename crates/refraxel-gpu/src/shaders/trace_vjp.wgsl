// The adjoint of a path, theory (2.15)–(2.18) and (2.27)–(2.29), step by step from the exit to the camera: `adjoint.rs`, `step.rs`
// and `event.rs` of the core.

// A segment as its adjoint needs it, and what it has received from its samples.
struct Step {
    start: vec3<f32>,
    kick: f32,
    momentum: vec3<f32>,
    drift: f32,
    d_start: vec3<f32>,
    late: f32,
    d_momentum: vec3<f32>,
    within: u32,
    // Σ dLoss/d(thickness) over its points, and Σ t times that.
    d_thickness: vec3<f32>,
    surface: u32,
    d_moment: vec3<f32>,
    beyond: u32,
    event: u32,
    // At its end.
    transmittance: f32,
    // The reflection at the surface, or 0.
    mirror: u32,
    padding_0: u32,
}

// dLoss/d(x, p).
struct StateAdjoint {
    x: vec3<f32>,
    p: vec3<f32>,
}

// At the end of a path whose momentum there is p, given dLoss/d(exit direction).
fn exit_vjp(p: vec3<f32>, d_direction: vec3<f32>) -> StateAdjoint {
    let n = length(p);
    let d = p / n;
    return StateAdjoint(vec3<f32>(0.0), (d_direction - d * dot(d, d_direction)) / n);
}

// Transpose of one step; `d_end` is dLoss/d(its length) where it ends on a surface.
fn step_vjp(s: Step, d_end: f32, d: ptr<function, StateAdjoint>) {
    if (s.event != 0u) {
        event_vjp(s, d_end, d);
    } else {
        // forward: x1 = x0 + h p1
        (*d).p += (*d).x * s.drift;
    }
    (*d).p += s.d_momentum;
    (*d).x += s.d_start;
    if (s.kick != 0.0) {
        // forward: p1 = p0 + k ∇w(x0)
        let d_force = (*d).p * s.kick;
        add_index_sample(s.within, s.start, 0.0, d_force);
        (*d).x += gradient_pullback(s.within, s.start, d_force);
    }
}

// `v`, whose sign is that of `outward`, but not smaller than GRAZING times `size`.
fn at_least(v: f32, outward: f32, size: f32) -> f32 {
    let least = GRAZING * size;
    return select(v, least * outward, abs(v) < least);
}

// Transpose of a drift that ends with an event, theory (2.27)–(2.29): from after the event to before the drift.
fn event_vjp(s: Step, d_end: f32, d: ptr<function, StateAdjoint>) {
    let outward = select(-1.0, 1.0, (s.event & FROM_INSIDE) != 0u);
    let refracts = (s.event & REFRACTS) != 0u;
    let p1 = s.momentum;
    let x = s.start + p1 * s.drift;
    let before = field_sample(s.within, x);
    let gradient = level_sample(s.surface, x).xyz;
    let size = length(gradient);
    let m = gradient / size;
    let p = p1 + before.xyz * s.late;
    let a = dot(p, m);
    var after = -a;
    if (refracts) {
        after = sqrt(a * a + (2.0 * field_sample(s.beyond, x).w - 2.0 * before.w)) * outward;
    }
    // forward: p' = p + (s − a) m with a = p · m, s = s(a, D), D = w_after − w_before, m = ∇φ/|∇φ|
    let change = after - a;
    let c = dot((*d).p, m);
    var d_a = -c;
    var d_s = c;
    var d_w_before = 0.0;
    var d_w_after = 0.0;
    var d_normal = (*d).p * change;
    if (s.mirror != 0u) {
        // Of the partial reflection, theory (7.4).
        d_a += reflections[s.mirror].d_before;
        d_s += reflections[s.mirror].d_after;
        d_w_before = reflections[s.mirror].d_w_before;
        d_w_after = reflections[s.mirror].d_w_after;
        (*d).p += reflections[s.mirror].d_p;
        (*d).x += reflections[s.mirror].d_position;
        d_normal -= reflections[s.mirror].d_p * (2.0 * a);
    }
    if (refracts) {
        // forward: s² = a² + 2D
        let least = at_least(after, outward, length(p + m * change));
        d_w_after += d_s / least;
        d_w_before -= d_s / least;
        d_a += d_s * a / least;
    } else {
        // forward: s = −a
        d_a -= d_s;
    }
    d_normal += p * d_a;
    (*d).p += m * d_a;
    let d_gradient = (d_normal - m * dot(m, d_normal)) / size;
    (*d).x += hessian(s.surface, x, d_gradient) + w_gradient(s.within, x) * d_w_before + w_gradient(s.beyond, x) * d_w_after;
    var d_tau = d_end + dot((*d).x, p1);
    var d_force = vec3<f32>(0.0);
    if (s.late != 0.0) {
        // forward: p = p1 + (τ − u) ∇w(x)
        d_force = (*d).p * s.late;
        let by_force = gradient_pullback(s.within, x, d_force);
        (*d).x += by_force;
        d_tau += dot(by_force, p1) + dot((*d).p, before.xyz);
    }
    // Vacuum has no coefficients.
    if (s.within != NO_REGION && (d_w_before != 0.0 || any(d_force != vec3<f32>(0.0)))) {
        add_index_sample(s.within, x, d_w_before, d_force);
    }
    if (s.beyond != NO_REGION && d_w_after != 0.0) {
        add_index_sample(s.beyond, x, d_w_after, vec3<f32>(0.0));
    }
    // forward: x = x0 + τ p1 with φ(x) = 0
    let d_phi = -d_tau / at_least(dot(gradient, p1), outward, size * length(p1));
    (*d).x += gradient * d_phi;
    (*d).p += (*d).x * s.drift;
    add_level_sample(s.surface, x, d_phi, d_gradient);
}

// Transpose of p = n(x) d at the camera, theory (2.18): dLoss/d(origin, direction).
fn start_vjp(origin: vec3<f32>, direction: vec3<f32>, d: StateAdjoint) -> StateAdjoint {
    let region = ruling_at(origin);
    if (region == NO_REGION) {
        return d;
    }
    let n = sqrt(2.0 * field_sample(region, origin).w);
    let d_w = dot(d.p, direction) / n;
    add_index_sample(region, origin, d_w, vec3<f32>(0.0));
    return StateAdjoint(d.x + w_gradient(region, origin) * d_w, d.p * n);
}
