// The finished picture, stretched over the canvas.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var linear: sampler;

struct Corner {
    @builtin(position) at: vec4<f32>,
    @location(0) place: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) k: u32) -> Corner {
    let place = vec2<f32>(f32(k & 1u) * 2.0, f32(k >> 1u) * 2.0);
    return Corner(vec4<f32>(place.x * 2.0 - 1.0, 1.0 - place.y * 2.0, 0.0, 1.0), place);
}

@fragment
fn pixel(in: Corner) -> @location(0) vec4<f32> {
    return textureSample(picture, linear, in.place);
}
