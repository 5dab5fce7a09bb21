// What bodies absorb along a path, theory (7.17): `absorption.rs` of the core.

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
