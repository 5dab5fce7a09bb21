// dLoss/d(ray), as the host reads it.

// The fields are those of `task::RayAdjoint` in Rust.
struct RayGradient {
    origin: vec3<f32>,
    padding_0: f32,
    direction: vec3<f32>,
    padding_1: f32,
    residual: vec3<f32>,
    padding_2: f32,
}
