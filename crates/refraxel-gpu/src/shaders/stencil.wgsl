// One evaluation of a grid of coefficients: the 4³ coefficients around a cell and their weights, theory (2.5)–(2.7).

// Weights V of the values of the four nodes of one axis, and D of the force.
struct AxisWeights {
    value: vec4<f32>,
    force: vec4<f32>,
}

fn axis_weights(interpolation: u32, f: f32) -> AxisWeights {
    let g = 1.0 - f;
    if (interpolation == TRILINEAR) {
        return AxisWeights(vec4<f32>(0.0, g, f, 0.0), vec4<f32>(0.0, -1.0, 1.0, 0.0));
    }
    if (interpolation == TRILINEAR_OF_DIFFERENCES) {
        return AxisWeights(vec4<f32>(0.0, g, f, 0.0), 0.5 * vec4<f32>(-g, -f, g, f));
    }
    let value = vec4<f32>(
        g * g * g / 6.0,
        (0.5 * f - 1.0) * f * f + 2.0 / 3.0,
        (0.5 * g - 1.0) * g * g + 2.0 / 3.0,
        f * f * f / 6.0,
    );
    return AxisWeights(value, vec4<f32>(-0.5 * g * g, (1.5 * f - 2.0) * f, (2.0 - 1.5 * g) * g, 0.5 * f * f));
}

// No compiler knows how often the loop over rows turns: written out wherever a grid is evaluated, it is so much code that software
// adapters compile it for minutes.
// (force, w) = (Σ D V V c, Σ V D V c, Σ V V D c, Σ V V V c) in the cell of node coordinates g, per node.
fn value_and_force(l: u32, interpolation: u32, cell: vec3<u32>, g: vec3<f32>) -> vec4<f32> {
    let f = g - vec3<f32>(cell);
    let x = axis_weights(interpolation, f.x);
    let y = axis_weights(interpolation, f.y);
    let z = axis_weights(interpolation, f.z);
    let n = lattices[l].nodes;
    let base = lattices[l].first + (cell.x - 1u) + n.x * ((cell.y - 1u) + n.y * (cell.z - 1u));
    var out = vec4<f32>(0.0);
    for (var row_number = 0u; row_number < bending.taps * bending.taps; row_number++) {
        let j = row_number % 4u;
        let k = row_number / 4u;
        let i = base + n.x * (j + n.y * k);
        let row = vec4<f32>(coefficients[i], coefficients[i + 1u], coefficients[i + 2u], coefficients[i + 3u]);
        let value = dot(x.value, row);
        out += vec4<f32>(
            dot(x.force, row) * y.value[j] * z.value[k],
            value * y.force[j] * z.value[k],
            value * y.value[j] * z.force[k],
            value * y.value[j] * z.value[k],
        );
    }
    return out;
}
