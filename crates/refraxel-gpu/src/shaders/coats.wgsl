// The clearcoat of opaque things, theory (7.13)–(7.16): `radiance/clearcoat` of the core. One record per ray, of the surface at which
// a straight ray ends.

// The fields are those of `coats::Coat` in Rust.
struct Coat {
    // X and A of theory (7.13).
    position: vec3<f32>,
    opacity: f32,
    // G of theory (7.13), and the mirrored share of the light for a strength of 1.
    slope: vec3<f32>,
    share: f32,
    // Unit direction of the mirrored ray; whether there is one.
    direction: vec3<f32>,
    is_there: u32,
    // G/|G|, and the strength at the place.
    normal: vec3<f32>,
    strength: f32,
    // The mirrored light.
    light: vec3<f32>,
    padding_0: u32,
    // What is seen behind the clearcoat, and dLoss/d(that).
    behind: vec3<f32>,
    padding_1: u32,
    d_behind: vec3<f32>,
    // dLoss/d(X, A, G).
    d_opacity: f32,
    d_position: vec3<f32>,
    padding_2: u32,
    d_slope: vec3<f32>,
    padding_3: u32,
}

// The probes of the strength and of what is mirrored lie behind those of all regions.
const STRENGTH: u32 = 2u * MAX_REGIONS;
const RADIANCE: u32 = 2u * MAX_REGIONS + 1u;

// The strength does not depend on a direction; this one is used for all look-ups.
const UP: vec3<f32> = vec3<f32>(0.0, 0.0, 1.0);

// A smooth step s/(s + e²) of a square s, and its derivative by s.
fn saturation(square: f32, least: f32) -> vec2<f32> {
    let sum = square + least * least;
    return vec2<f32>(square / sum, least * least / (sum * sum));
}

// Light that arrives in vacuum at a clearcoat, at an angle of this cosine.
fn incidence_of(cosine: f32) -> Incidence {
    let square = bending.coat_index * bending.coat_index;
    return Incidence(cosine, sqrt(square - 1.0 + cosine * cosine), 0.5, 0.5 * square);
}
