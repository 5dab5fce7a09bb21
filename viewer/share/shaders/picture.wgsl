// The picture: each pixel follows its ray and collects what it meets, theory (3.9), (7.5) and (7.18).

// Light of sRGB codes, and back: IEC 61966-2-1.
fn light(code: vec3<f32>) -> vec3<f32> {
    let curve = pow((max(code, vec3<f32>(0.0)) + 0.055) / 1.055, vec3<f32>(2.4));
    return select(curve, code / 12.92, code <= vec3<f32>(0.04045));
}

fn code(light: vec3<f32>) -> vec3<f32> {
    let curve = 1.055 * pow(max(light, vec3<f32>(0.0)), vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(curve, 12.92 * light, light <= vec3<f32>(0.0031308));
}

// What a ray has collected so far.
struct Seen {
    colour: vec3<f32>,
    // Optical thickness of the bodies so far.
    thickness: vec3<f32>,
}

// Collects along a straight piece; `growth` is that of the thickness in t.
fn collect(front: ptr<function, Front>, seen: ptr<function, Seen>, x: vec3<f32>, p: vec3<f32>, end: f32, near: f32, growth: vec3<f32>) {
    let inside = clip(x, p, near);
    let range = vec2<f32>(inside.x, min(inside.y, end));
    if (!(*front).opaque && range.x < range.y) {
        enter(front, x, p, range);
        var basis = basis_lanes(normalize(p));
        var s: Sample;
        while (!(*front).opaque && next_sample(front, &s)) {
            let thickness = (*seen).thickness + growth * s.t;
            var colour = shade(s.corner, s.weight, &basis);
            if (any(thickness > vec3<f32>(0.0))) {
                colour = code(light(colour) * exp(-thickness));
            }
            (*seen).colour += s.before * s.alpha * colour;
        }
    }
    if (end < FAR) {
        (*seen).thickness += growth * end;
    }
}

// What shows behind everything, attenuated.
fn behind(seen: Seen, direction: vec3<f32>) -> vec3<f32> {
    let colour = background_radiance(direction);
    return select(colour, code(light(colour) * exp(-seen.thickness)), any(seen.thickness > vec3<f32>(0.0)));
}

// What a straight ray shows, from where another one is reflected.
fn mirrored(x: vec3<f32>, d: vec3<f32>) -> vec3<f32> {
    var front = front_of(0.5);
    var seen = Seen();
    collect(&front, &seen, x, d, FAR, 0.0, vec3<f32>(0.0));
    return seen.colour + front.transmittance * behind(seen, d);
}

// The first surface that a ray enters from outside: what is seen before it, and what it mirrors.
struct Mirror {
    colour: vec3<f32>,
    before: f32,
    light: vec3<f32>,
    share: f32,
}

fn radiance(origin: vec3<f32>, direction: vec3<f32>) -> vec3<f32> {
    var front = front_of(0.5);
    var seen = Seen();
    var mirror = Mirror(vec3<f32>(0.0), 1.0, vec3<f32>(0.0), 0.0);
    var x = origin;
    var within = -1;
    if (view.straight == 0u) {
        within = ruling_at(origin);
    }
    var p = direction * sqrt(2.0 * field_of(within, x).w);
    var near = task.near / length(p);
    var from_t = 0.0;
    for (var event = 0u; event < MOST_EVENTS; event++) {
        if (front.opaque) {
            break;
        }
        var next = Meeting(FAR, -1, 1.0);
        var growth = vec3<f32>(0.0);
        if (within >= 0) {
            growth = regions[within].absorption * length(p);
            if ((regions[within].kind & IS_UNIFORM) != 0u) {
                next = next_surface(u32(within), x, p, FAR);
            } else {
                // Marched with half a kick first; kicks are those of theory (2.10).
                let h = regions[within].step;
                var kick = 0.5 * h;
                for (var k = 0u; k < MOST_STEPS; k++) {
                    p += field_of(within, x).xyz * kick;
                    kick = h;
                    next = next_surface(u32(within), x, p, h);
                    if (next.region >= 0 || front.opaque) {
                        break;
                    }
                    collect(&front, &seen, x, p, h, 0.0, regions[within].absorption * length(p));
                    x += p * h;
                }
            }
            if (next.region < 0) {
                break;
            }
        } else if (view.straight == 0u) {
            next = next_region(x, p, from_t);
        }
        collect(&front, &seen, x, p, next.t, near, growth);
        near = 0.0;
        from_t = 0.0;
        if (next.region < 0) {
            break;
        }
        x += p * next.t;
        if ((regions[next.region].kind & IS_BODY) == 0u) {
            // Through a field without a surface, to the face of its box.
            let r = next.region;
            let h = regions[r].step;
            var kick = 0.5 * h;
            for (var k = 0u; k < MOST_STEPS; k++) {
                p += field_of(r, x).xyz * kick;
                kick = h;
                let n = length(p);
                let share = clamp((n - 1.0) / max(regions[r].largest - 1.0, 0.01), 0.0, 1.0);
                collect(&front, &seen, x, p, h, 0.0, regions[r].absorption * (n * share));
                x += p * h;
                if (front.opaque || clip_region(u32(r), x, p).y <= h) {
                    break;
                }
            }
            from_t = max(clip_region(u32(r), x, p).y, 0.0) + 1e-4 * h;
            continue;
        }
        let enters = next.side > 0.0;
        let beyond = ruling_behind(next.region, enters, x, p);
        let m = normalize(level(u32(next.region), x).xyz);
        let a = dot(p, m);
        let w_before = field_of(within, x).w;
        let w_after = field_of(beyond, x).w;
        let square = a * a + 2.0 * (w_after - w_before);
        if (square <= 0.0) {
            p -= 2.0 * a * m;
            continue;
        }
        let s = sqrt(square);
        if (within < 0 && beyond >= 0 && mirror.share == 0.0) {
            mirror = Mirror(seen.colour, front.transmittance, vec3<f32>(0.0), 0.0);
            mirror.share = regions[next.region].strength * reflectance(abs(a), s, w_before, w_after);
            if (mirror.share > 0.0) {
                mirror.light = mirrored(x, normalize(p - 2.0 * a * m));
            }
        }
        p += (select(-s, s, a > 0.0) - a) * m;
        within = beyond;
    }
    let direction_out = normalize(p);
    let whole = seen.colour + front.transmittance * behind(seen, direction_out);
    if (mirror.share <= 0.0) {
        return whole;
    }
    let rest = max(whole - mirror.colour, vec3<f32>(0.0)) / max(mirror.before, 1e-4);
    return mirror.colour + mirror.before * code(mix(light(rest), light(mirror.light), mirror.share));
}

@vertex
fn corner(@builtin(vertex_index) k: u32) -> @builtin(position) vec4<f32> {
    return vec4<f32>(f32(k & 1u) * 4.0 - 1.0, f32(k >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

@fragment
fn pixel(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    let d = normalize(view.forward + (at.x - 0.5 * view.width) * view.right + (at.y - 0.5 * view.height) * view.down);
    return vec4<f32>(clamp(radiance(view.eye, d), vec3<f32>(0.0), vec3<f32>(1.0)), 1.0);
}
