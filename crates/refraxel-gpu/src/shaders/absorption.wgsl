// What bodies absorb along a path, theory (7.17)–(7.20): `absorption.rs` and `light.rs` of the core. Where nothing absorbs and
// nothing shall learn to, colours pass as they are.

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

// The arc length within the body by t, and its derivative by |p|, theory (7.17): the length is |p| t times the share of the body.
fn reach_of(region: u32, speed: f32) -> vec2<f32> {
    if (regions[region].body != NO_BODY) {
        return vec2<f32>(speed, 1.0);
    }
    let slope = 1.0 / regions[region].contrast;
    let share = (speed - 1.0) * slope;
    return vec2<f32>(speed * share, share + speed * slope);
}

// Growth of the optical thickness in t along a segment.
fn thickness_growth(region: u32, speed: f32) -> vec3<f32> {
    if (!absorbs() || region == NO_REGION) {
        return vec3<f32>(0.0);
    }
    return regions[region].absorption * reach_of(region, speed).x;
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
