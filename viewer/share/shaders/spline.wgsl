// Cubic B-splines on the nodes of a box, theory (2.5): level sets, with the planes that cut them, and the fields w = n²/2.

struct Weights {
    value: vec4<f32>,
    slope: vec4<f32>,
}

fn spline_weights(f: f32) -> Weights {
    let g = 1.0 - f;
    return Weights(
        vec4<f32>(g * g * g, 4.0 - 6.0 * f * f + 3.0 * f * f * f, 4.0 - 6.0 * g * g + 3.0 * g * g * g, f * f * f) / 6.0,
        vec4<f32>(-0.5 * g * g, (1.5 * f - 2.0) * f, -(1.5 * g - 2.0) * g, 0.5 * f * f),
    );
}

// Value and, in the first three, gradient [1 / node] at node coordinates inside the grid.
fn spline(first: u32, nodes: vec3<u32>, at: vec3<f32>) -> vec4<f32> {
    let cell = clamp(vec3<i32>(floor(at)), vec3<i32>(1), vec3<i32>(nodes) - 3);
    let f = at - vec3<f32>(cell);
    let x = spline_weights(f.x);
    let y = spline_weights(f.y);
    let z = spline_weights(f.z);
    let base = vec3<u32>(cell - 1);
    var sum = vec4<f32>(0.0);
    for (var k = 0u; k < 4u; k++) {
        for (var j = 0u; j < 4u; j++) {
            let row = first + base.x + nodes.x * (base.y + j + nodes.y * (base.z + k));
            let c = vec4<f32>(numbers[row], numbers[row + 1u], numbers[row + 2u], numbers[row + 3u]);
            let value = dot(x.value, c);
            sum += vec4<f32>(
                dot(x.slope, c) * y.value[j] * z.value[k], value * y.slope[j] * z.value[k],
                value * y.value[j] * z.slope[k], value * y.value[j] * z.value[k],
            );
        }
    }
    return sum;
}

// (m, h) of a plane of a body: its height at node coordinates g is h + m·g, theory (4.14).
fn plane_of(r: u32, k: u32) -> vec4<f32> {
    let at = regions[r].first_plane + 4u * k;
    return vec4<f32>(numbers[at], numbers[at + 1u], numbers[at + 2u], numbers[at + 3u]);
}

// Gradient [1] and value φ of a body [scene unit]: of its level set, or of the highest of its planes where that is higher.
fn level(r: u32, x: vec3<f32>) -> vec4<f32> {
    if (regions[r].planes == 0u) {
        return level_of_spline(r, x);
    }
    let at = (x - regions[r].lowest) * regions[r].nodes_per_unit;
    var highest = vec4<f32>(0.0, 0.0, 0.0, -FAR);
    for (var k = 0u; k < regions[r].planes; k++) {
        let plane = plane_of(r, k);
        let height = plane.w + dot(plane.xyz, at);
        if (height > highest.w) {
            highest = vec4<f32>(plane.xyz * regions[r].nodes_per_unit, height);
        }
    }
    if ((regions[r].kind & IS_OF_PLANES) != 0u) {
        return highest;
    }
    let spline = level_of_spline(r, x);
    return select(spline, highest, highest.w > spline.w);
}

// The same of its level set, whatever planes there are; outside its box far from it.
fn level_of_spline(r: u32, x: vec3<f32>) -> vec4<f32> {
    let at = (x - regions[r].lowest) * regions[r].nodes_per_unit;
    let last = vec3<f32>(regions[r].nodes - 1u);
    if (any(at < vec3<f32>(1.0)) || any(at > last - 1.0)) {
        return vec4<f32>(0.0, 0.0, 0.0, 1.0);
    }
    let s = spline(regions[r].surface, regions[r].nodes, at);
    return vec4<f32>(s.xyz * regions[r].nodes_per_unit, s.w);
}

// Gradient and value of w = n²/2 of a region; −1 is vacuum.
fn field_of(r: i32, x: vec3<f32>) -> vec4<f32> {
    if (r < 0) {
        return vec4<f32>(0.0, 0.0, 0.0, 0.5);
    }
    let k = u32(r);
    if ((regions[k].kind & IS_UNIFORM) != 0u) {
        return vec4<f32>(0.0, 0.0, 0.0, 0.5 * regions[k].index * regions[k].index);
    }
    let at = (x - regions[k].field_lowest) * regions[k].field_nodes_per_unit;
    let last = vec3<f32>(regions[k].field_nodes - 1u);
    let is_rim = any(at < vec3<f32>(1.0)) || any(at > last - 1.0);
    if (is_rim && (regions[k].kind & IS_BODY) == 0u) {
        return vec4<f32>(0.0, 0.0, 0.0, 0.5);
    }
    let s = spline(regions[k].field, regions[k].field_nodes, at);
    // n − 1 times the contrast.
    let n = sqrt(2.0 * s.w);
    let m = 1.0 + regions[k].contrast * (n - 1.0);
    return vec4<f32>(s.xyz * regions[k].field_nodes_per_unit * (regions[k].contrast * m / n), 0.5 * m * m);
}
