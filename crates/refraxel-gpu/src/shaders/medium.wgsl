// Regions of refractive index in vacuum, and which one rules where bodies overlap, theory (2.23): `index/` of the core.

// The fields are those of `bodies::Region` in Rust.
struct Region {
    lowest: vec3<f32>,
    // Whether it has a sharp surface: NO_BODY, BODY or BODY_OF_PLANES.
    body: u32,
    highest: vec3<f32>,
    // Whether rays are straight all through the box.
    is_uniform: u32,
    // Length of a step in t [scene unit].
    step: f32,
    interpolation: u32,
    // Difference between the largest index and that of vacuum.
    contrast: f32,
    // How many planes enclose it or cut its spline, and where the first of them is among the coefficients.
    planes: u32,
    // Absorption coefficients [1 / scene unit].
    absorption: vec3<f32>,
    first_plane: u32,
    // Slope of w [1 / scene unit] below which a transition is that of a lens and mirrors nothing.
    gentlest: f32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

// (m, h) of a plane of a body: its height at node coordinates g is h + m·g, theory (4.14).
fn facet(region: u32, k: u32) -> vec4<f32> {
    let at = regions[region].first_plane + 4u * k;
    return vec4<f32>(coefficients[at], coefficients[at + 1u], coefficients[at + 2u], coefficients[at + 3u]);
}

// The plane of a body that is the highest at node coordinates g.
fn highest_facet(region: u32, g: vec3<f32>) -> u32 {
    var highest = -FAR;
    var which = 0u;
    for (var k = 0u; k < regions[region].planes; k++) {
        let plane = facet(region, k);
        let height = plane.w + dot(plane.xyz, g);
        if (height > highest) {
            highest = height;
            which = k;
        }
    }
    return which;
}

// (∇φ, φ) of a body at node coordinates [per node].
fn level_sample_at(region: u32, g: vec3<f32>) -> vec4<f32> {
    if (regions[region].planes == 0u) {
        return spline_sample_at(region, g);
    }
    let highest = facet(region, highest_facet(region, g));
    let plane = vec4<f32>(highest.xyz, highest.w + dot(highest.xyz, g));
    if (regions[region].body == BODY_OF_PLANES) {
        return plane;
    }
    let spline = spline_sample_at(region, g);
    return select(spline, plane, plane.w > spline.w);
}

// The same of its spline, whatever planes there are; half a voxel outside the spline.
fn spline_sample_at(region: u32, g: vec3<f32>) -> vec4<f32> {
    let l = 2u * region + 1u;
    let beyond = vec4<f32>(0.0, 0.0, 0.0, BORDER_VALUE * lattices[l].voxel);
    if (!lattice_holds(l, g)) {
        return beyond;
    }
    let cell = lattice_cell(l, g);
    if (is_rim(l, cell)) {
        return beyond;
    }
    return value_and_force(l, CUBIC_B_SPLINE, cell, g);
}

// Whether φ of a body at node coordinates is its spline, and no plane.
fn is_of_spline(region: u32, g: vec3<f32>) -> bool {
    if (regions[region].planes == 0u) {
        return true;
    }
    let plane = facet(region, highest_facet(region, g));
    return regions[region].body == BODY && spline_sample_at(region, g).w >= plane.w + dot(plane.xyz, g);
}

// (∇φ [1], φ [scene unit]) of a body.
fn level_sample(region: u32, x: vec3<f32>) -> vec4<f32> {
    let l = 2u * region + 1u;
    return level_sample_at(region, lattice_node(l, x)) * vec4<f32>(lattices[l].scale, 1.0);
}

// Whether a ray of momentum p at x goes on inside a body.
fn holds_ahead(region: u32, x: vec3<f32>, p: vec3<f32>) -> bool {
    let phi = level_sample(region, x);
    let stands_on = abs(phi.w) < TOUCH * lattices[2u * region + 1u].voxel;
    return select(phi.w, dot(phi.xyz, p), stands_on) < 0.0;
}

// The cell in whose coefficients the index of a region lies, where it is not that of vacuum.
struct IndexCell {
    cell: vec3<u32>,
    found: bool,
}

// That of node coordinates: none outside the box and along its faces, where only bodies are continued.
fn index_cell(region: u32, g: vec3<f32>) -> IndexCell {
    let l = 2u * region;
    if (!lattice_holds(l, g)) {
        return IndexCell(vec3<u32>(0u), false);
    }
    let cell = lattice_cell(l, g);
    let next = clamp(cell, vec3<u32>(1u), lattices[l].nodes - vec3<u32>(3u));
    return IndexCell(next, all(cell == next) || regions[region].body != NO_BODY);
}

// (∇w [1 / scene unit], w) of a region; that of vacuum outside its box, where no body is continued.
fn index_sample(region: u32, x: vec3<f32>) -> vec4<f32> {
    let l = 2u * region;
    let g = lattice_node(l, x);
    let c = index_cell(region, g);
    if (!c.found) {
        return vec4<f32>(0.0, 0.0, 0.0, VACUUM);
    }
    return value_and_force(l, regions[region].interpolation, c.cell, g) * vec4<f32>(lattices[l].scale, 1.0);
}

// (∇w, w) of a region, or of vacuum.
fn field_sample(region: u32, x: vec3<f32>) -> vec4<f32> {
    if (region == NO_REGION) {
        return vec4<f32>(0.0, 0.0, 0.0, VACUUM);
    }
    return index_sample(region, x);
}

// True where the index of a region does not change: in flat cells and outside the box.
fn is_flat(region: u32, x: vec3<f32>) -> bool {
    return clearance_at(2u * region, lattice_node(2u * region, x)) != 0u;
}

// The t between which a line is in the box of a region; empty where the first is not below the second.
fn clip_region(region: u32, x: vec3<f32>, p: vec3<f32>) -> vec2<f32> {
    let lowest = regions[region].lowest;
    let highest = regions[region].highest;
    let a = clip_axis(x.x, p.x, lowest.x, highest.x);
    let b = clip_axis(x.y, p.y, lowest.y, highest.y);
    let c = clip_axis(x.z, p.z, lowest.z, highest.z);
    return vec2<f32>(max(0.0, max(a.x, max(b.x, c.x))), min(a.y, min(b.y, c.y)));
}

// The region whose field holds at a point; NO_REGION in vacuum.
fn ruling_at(x: vec3<f32>) -> u32 {
    for (var k = bending.regions; k > 0u; k--) {
        let region = k - 1u;
        if (all(x >= regions[region].lowest) && all(x <= regions[region].highest)) {
            if (regions[region].body == NO_BODY || level_sample(region, x).w < 0.0) {
                return region;
            }
        }
    }
    return NO_REGION;
}

// The body that rules just behind the point x on the surface of a body, for a ray that enters it or leaves it.
fn ruling_behind(surface: u32, enters: bool, x: vec3<f32>, p: vec3<f32>) -> u32 {
    for (var k = bending.regions; k > 0u; k--) {
        let region = k - 1u;
        if (region == surface) {
            if (enters) {
                return surface;
            }
        } else if (regions[region].body != NO_BODY && holds_ahead(region, x, p)) {
            return region;
        }
    }
    return NO_REGION;
}
