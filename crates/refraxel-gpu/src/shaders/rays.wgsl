// Rays, and what they show.

// A ray with what it should show. The fields are those of `task::Lesson` in Rust.
struct Lesson {
    origin: vec3<f32>,
    // Shift of the quadrature points [step].
    offset: f32,
    direction: vec3<f32>,
    // Whether the ray may bend, where rays do.
    bends: u32,
    // Observed colour (sRGB-encoded).
    colour: vec3<f32>,
    // Its pixel lies beside the mask of what is refractive.
    beside: u32,
    // Radiance behind the field, where WANTS says that it is given.
    behind: vec3<f32>,
    // No pixel was found for the ray: nothing is learned from it.
    is_absent: u32,
}

// What a ray shows.
struct Seen {
    // Over the background.
    colour: vec3<f32>,
    transmittance: f32,
    behind: vec3<f32>,
    depth: f32,
}
