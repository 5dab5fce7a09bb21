// The background at infinity, theory (3.15): an equirectangular panorama, or one colour.

// Fractional texel coordinates (column, row) of a unit direction.
fn texel_coordinates(d: vec3<f32>) -> vec2<f32> {
    let rows = f32(scene.rows);
    let flat = sqrt(max(d.x * d.x + d.y * d.y, POLE));
    return vec2<f32>((atan2(d.y, d.x) / TAU + 0.5) * 2.0 * rows - 0.5, atan2(flat, d.z) / (0.5 * TAU) * rows - 0.5);
}

// The four texels around a direction: left and right of the upper row, then of the lower one.
struct TexelCell {
    index: vec4<u32>,
    fraction: vec2<f32>,
}

fn texel_cell(d: vec3<f32>) -> TexelCell {
    let at = texel_coordinates(d);
    let low = floor(at);
    let columns = 2 * i32(scene.rows);
    let last = i32(scene.rows) - 1;
    // Columns lie in [−1, 2 rows): one turn makes them positive.
    let column = vec2<u32>((i32(low.x) + vec2<i32>(0, 1) + columns) % columns);
    let row = vec2<u32>(clamp(i32(low.y) + vec2<i32>(0, 1), vec2<i32>(0), vec2<i32>(last))) * u32(columns);
    return TexelCell(vec4<u32>(row.x + column, row.y + column), at - low);
}

fn texel_weights(f: vec2<f32>) -> vec4<f32> {
    let g = 1.0 - f;
    return vec4<f32>(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y);
}

fn texel(i: u32) -> vec3<f32> {
    return vec3<f32>(texels[3u * i], texels[3u * i + 1u], texels[3u * i + 2u]);
}

// Radiance that arrives against a unit direction of travel.
fn background_radiance(d: vec3<f32>) -> vec3<f32> {
    if (scene.rows == 0u) {
        return scene.plain;
    }
    let cell = texel_cell(d);
    let w = texel_weights(cell.fraction);
    return w.x * texel(cell.index.x) + w.y * texel(cell.index.y) + w.z * texel(cell.index.z) + w.w * texel(cell.index.w);
}

// Transpose of its derivative by the direction, as a free vector.
fn background_radiance_vjp(d: vec3<f32>, d_radiance: vec3<f32>) -> vec3<f32> {
    if (scene.rows == 0u) {
        return vec3<f32>(0.0);
    }
    let rows = f32(scene.rows);
    let flat2 = max(d.x * d.x + d.y * d.y, POLE);
    let flat = sqrt(flat2);
    let d_column = vec3<f32>(-d.y, d.x, 0.0) * (2.0 * rows / (TAU * flat2));
    let d_row = vec3<f32>(d.x * d.z / flat, d.y * d.z / flat, -flat) * (rows / (0.5 * TAU));
    let cell = texel_cell(d);
    let f = cell.fraction;
    let v = vec4<f32>(
        dot(d_radiance, texel(cell.index.x)), dot(d_radiance, texel(cell.index.y)),
        dot(d_radiance, texel(cell.index.z)), dot(d_radiance, texel(cell.index.w)),
    );
    return d_column * mix(v.y - v.x, v.w - v.z, f.y) + d_row * mix(v.z - v.x, v.w - v.y, f.x);
}
