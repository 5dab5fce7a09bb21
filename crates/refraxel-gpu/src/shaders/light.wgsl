// Light and the codes of the field: what absorbs, theory (7.18) and (7.19), and the mixture of mirrored and transmitted light, theory
// (7.5) and (7.6). `light.rs` of the core. Where nothing absorbs and nothing shall learn to, colours pass as they are.

// An optical thickness per channel, and e^(−thickness/γ).
struct Filter {
    thickness: vec3<f32>,
    factor: vec3<f32>,
}

// A colour behind a filter, and its derivatives.
struct Filtered {
    colour: vec3<f32>,
    // By the colour before.
    slope: vec3<f32>,
    by_thickness: vec3<f32>,
}

fn absorbs() -> bool {
    return (task.wants & ABSORBS) != 0u;
}

fn filter_of(thickness: vec3<f32>) -> Filter {
    if (!absorbs()) {
        return Filter(vec3<f32>(0.0), vec3<f32>(1.0));
    }
    return Filter(thickness, exp(thickness * (-1.0 / GAMMA)));
}

// The colour that is seen through a filter, theory (7.18).
fn through(f: Filter, before: vec3<f32>) -> vec3<f32> {
    if (!absorbs()) {
        return before;
    }
    return filtered(f, before).colour;
}

fn filtered(f: Filter, before: vec3<f32>) -> Filtered {
    let x = filtered_channel(f.thickness.x, f.factor.x, before.x);
    let y = filtered_channel(f.thickness.y, f.factor.y, before.y);
    let z = filtered_channel(f.thickness.z, f.factor.z, before.z);
    return Filtered(vec3<f32>(x.x, y.x, z.x), vec3<f32>(x.y, y.y, z.y), vec3<f32>(x.z, y.z, z.z));
}

// Colour, slope and derivative by thickness of one channel, theory (7.18) and (7.19).
fn filtered_channel(u: f32, k: f32, before: f32) -> vec3<f32> {
    if (u == 0.0) {
        return vec3<f32>(before, 1.0, select(-before, (before + LIGHT_OFFSET) * (-1.0 / GAMMA), before > LIGHT_TOE));
    }
    let above = (before + LIGHT_OFFSET) * k;
    let after = above - LIGHT_OFFSET;
    if (before > LIGHT_TOE && after > LIGHT_TOE) {
        return vec3<f32>(after, k, above * (-1.0 / GAMMA));
    }
    let light = light_of(before);
    let transmittance = exp(-u);
    let code = code_of(light.x * transmittance);
    return vec3<f32>(code.x, code.y * transmittance * light.y, -code.y * transmittance * light.x);
}

// Light of an sRGB code, and its slope.
fn light_of(code: f32) -> vec2<f32> {
    if (code <= LIGHT_TOE) {
        return vec2<f32>(code / LIGHT_TOE_SLOPE, 1.0 / LIGHT_TOE_SLOPE);
    }
    let base = (code + LIGHT_OFFSET) / (1.0 + LIGHT_OFFSET);
    let power = pow(base, GAMMA - 1.0);
    return vec2<f32>(power * base, power * (GAMMA / (1.0 + LIGHT_OFFSET)));
}

// sRGB code of light, and its slope.
fn code_of(light: f32) -> vec2<f32> {
    if (light <= LIGHT_TOE / LIGHT_TOE_SLOPE) {
        return vec2<f32>(light * LIGHT_TOE_SLOPE, LIGHT_TOE_SLOPE);
    }
    let power = pow(light, 1.0 / GAMMA);
    return vec2<f32>(power * (1.0 + LIGHT_OFFSET) - LIGHT_OFFSET, power / light * ((1.0 + LIGHT_OFFSET) / GAMMA));
}

// The colour of a surface that mirrors a share of the light and passes the rest of what is behind.
fn mixed(share: f32, mirrored: vec3<f32>, behind: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        mixed_channel(share, mirrored.x, behind.x), mixed_channel(share, mirrored.y, behind.y),
        mixed_channel(share, mirrored.z, behind.z),
    );
}

fn mixed_channel(share: f32, mirrored: f32, behind: f32) -> f32 {
    let r = light_of(mirrored).x;
    let t = light_of(behind).x;
    return code_of(t + (r - t) * share).x;
}

// dLoss/d(arguments of `mixed`).
struct MixAdjoint {
    mirrored: vec3<f32>,
    share: f32,
    behind: vec3<f32>,
}

fn mixed_vjp(share: f32, mirrored: vec3<f32>, behind: vec3<f32>, d_shown: vec3<f32>) -> MixAdjoint {
    let x = mixed_channel_vjp(share, mirrored.x, behind.x, d_shown.x);
    let y = mixed_channel_vjp(share, mirrored.y, behind.y, d_shown.y);
    let z = mixed_channel_vjp(share, mirrored.z, behind.z, d_shown.z);
    return MixAdjoint(vec3<f32>(x.x, y.x, z.x), x.y + y.y + z.y, vec3<f32>(x.z, y.z, z.z));
}

// dLoss/d(mirrored, share, behind) of one channel.
fn mixed_channel_vjp(share: f32, mirrored: f32, behind: f32, d_shown: f32) -> vec3<f32> {
    let r = light_of(mirrored);
    let t = light_of(behind);
    let d_light = d_shown * code_of(t.x + (r.x - t.x) * share).y;
    return vec3<f32>(d_light * share * r.y, d_light * (r.x - t.x), d_light * (1.0 - share) * t.y);
}
