// Transposes of one evaluation of a grid of coefficients, theory (2.16): `stencil.rs` and `sample.rs` of the core.

// Slopes of the weights of `AxisWeights`.
struct AxisSlopes {
    value: vec4<f32>,
    force: vec4<f32>,
}

fn axis_slopes(interpolation: u32, f: f32) -> AxisSlopes {
    let g = 1.0 - f;
    let linear = vec4<f32>(0.0, -1.0, 1.0, 0.0);
    if (interpolation == TRILINEAR) {
        return AxisSlopes(linear, vec4<f32>(0.0));
    }
    if (interpolation == TRILINEAR_OF_DIFFERENCES) {
        return AxisSlopes(linear, vec4<f32>(0.5, -0.5, -0.5, 0.5));
    }
    return AxisSlopes(axis_weights(interpolation, f).force, vec4<f32>(g, 3.0 * f - 2.0, 3.0 * g - 2.0, f));
}

// Jᵀu with J = d(force)/dx, per node.
fn force_pullback(l: u32, interpolation: u32, cell: vec3<u32>, g: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let f = g - vec3<f32>(cell);
    let x = axis_weights(interpolation, f.x);
    let y = axis_weights(interpolation, f.y);
    let z = axis_weights(interpolation, f.z);
    let along_x = axis_slopes(interpolation, f.x);
    let along_y = axis_slopes(interpolation, f.y);
    let along_z = axis_slopes(interpolation, f.z);
    let n = lattices[l].nodes;
    let base = lattices[l].first + (cell.x - 1u) + n.x * ((cell.y - 1u) + n.y * (cell.z - 1u));
    var out = vec3<f32>(0.0);
    for (var row_number = 0u; row_number < bending.taps * bending.taps; row_number++) {
        let j = row_number % 4u;
        let k = row_number / 4u;
        let i = base + n.x * (j + n.y * k);
        let row = vec4<f32>(coefficients[i], coefficients[i + 1u], coefficients[i + 2u], coefficients[i + 3u]);
        let value = dot(x.value, row);
        let force = dot(x.force, row);
        out += vec3<f32>(
            u.x * dot(along_x.force, row) * y.value[j] * z.value[k]
                + dot(along_x.value, row) * (u.y * y.force[j] * z.value[k] + u.z * y.value[j] * z.force[k]),
            value * (u.y * along_y.force[j] * z.value[k] + u.z * along_y.value[j] * z.force[k])
                + u.x * force * along_y.value[j] * z.value[k],
            value * (u.z * y.value[j] * along_z.force[k] + u.y * y.force[j] * along_z.value[k])
                + u.x * force * y.value[j] * along_z.value[k],
        );
    }
    return out;
}

// Jᵀv with J = d(∇w)/dx in a region.
fn gradient_pullback(region: u32, x: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let l = 2u * region;
    let g = lattice_node(l, x);
    let c = index_cell(region, g);
    if (!c.found) {
        return vec3<f32>(0.0);
    }
    let scale = lattices[l].scale;
    return force_pullback(l, regions[region].interpolation, c.cell, g, v * scale) * scale;
}

// The gradient of w itself; 0 in vacuum.
fn w_gradient(region: u32, x: vec3<f32>) -> vec3<f32> {
    if (region == NO_REGION) {
        return vec3<f32>(0.0);
    }
    let l = 2u * region;
    let g = lattice_node(l, x);
    let c = index_cell(region, g);
    if (!c.found) {
        return vec3<f32>(0.0);
    }
    // The force of the trilinear interpolation is the gradient of the w that both have.
    let own = regions[region].interpolation;
    let interpolation = select(own, TRILINEAR, own == TRILINEAR_OF_DIFFERENCES);
    return value_and_force(l, interpolation, c.cell, g).xyz * lattices[l].scale;
}

// Hess(φ) v of a body: 0 where its faces are flat.
fn hessian(region: u32, x: vec3<f32>, v: vec3<f32>) -> vec3<f32> {
    let l = 2u * region + 1u;
    let g = lattice_node(l, x);
    if (!lattice_holds(l, g) || !is_of_spline(region, g)) {
        return vec3<f32>(0.0);
    }
    let cell = lattice_cell(l, g);
    if (is_rim(l, cell)) {
        return vec3<f32>(0.0);
    }
    let scale = lattices[l].scale;
    return force_pullback(l, CUBIC_B_SPLINE, cell, g, v * scale) * scale;
}

// The weights of the border, whose coefficients are no parameters, are 0.
fn without_border(w: vec4<f32>, cell: u32, nodes: u32) -> vec4<f32> {
    let node = vec4<u32>(cell) + vec4<u32>(0u, 1u, 2u, 3u);
    return select(vec4<f32>(0.0), w, (node >= vec4<u32>(BORDER + 1u)) & (node < vec4<u32>(nodes + 1u - BORDER)));
}

// Transpose of `value_and_force` with respect to the coefficients.
fn scatter_stencil(l: u32, interpolation: u32, cell: vec3<u32>, g: vec3<f32>, d_value: f32, d_force: vec3<f32>, border: bool) {
    let f = g - vec3<f32>(cell);
    var x = axis_weights(interpolation, f.x);
    var y = axis_weights(interpolation, f.y);
    var z = axis_weights(interpolation, f.z);
    let n = lattices[l].nodes;
    if (!border) {
        x = AxisWeights(without_border(x.value, cell.x, n.x), without_border(x.force, cell.x, n.x));
        y = AxisWeights(without_border(y.value, cell.y, n.y), without_border(y.force, cell.y, n.y));
        z = AxisWeights(without_border(z.value, cell.z, n.z), without_border(z.force, cell.z, n.z));
    }
    let base = lattices[l].first + (cell.x - 1u) + n.x * ((cell.y - 1u) + n.y * (cell.z - 1u));
    for (var row_number = 0u; row_number < bending.taps * bending.taps; row_number++) {
        let j = row_number % 4u;
        let k = row_number / 4u;
        // forward: w = Σ V V V c, force = (Σ D V V c, Σ V D V c, Σ V V D c)
        let by_value = y.value[j] * (d_value * z.value[k] + d_force.z * z.force[k]) + d_force.y * y.force[j] * z.value[k];
        let row = x.value * by_value + x.force * (d_force.x * y.value[j] * z.value[k]);
        let i = base + n.x * (j + n.y * k);
        add_index_gradient(i, row.x);
        add_index_gradient(i + 1u, row.y);
        add_index_gradient(i + 2u, row.z);
        add_index_gradient(i + 3u, row.w);
    }
}
