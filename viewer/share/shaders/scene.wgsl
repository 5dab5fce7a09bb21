// What the renderer of a shared page reads: the scene as `verbs/export/html` of the program writes it.

// How the picture is made. The fields are those of `View` in renderer.ts.
struct View {
    eye: vec3<f32>,
    regions: u32,
    // Axes of the camera, of the length of a pixel at distance 1.
    right: vec3<f32>,
    width: f32,
    down: vec3<f32>,
    height: f32,
    forward: vec3<f32>,
    straight: u32,
}

// A refractive region. The fields are those of `region` in verbs/export/html/regions.rs.
struct Region {
    lowest: vec3<f32>,
    // The index of a body that has one.
    index: f32,
    nodes_per_unit: vec3<f32>,
    // Longest step in t.
    step: f32,
    absorption: vec3<f32>,
    // Share of Fresnel's reflectance that is seen.
    strength: f32,
    nodes: vec3<u32>,
    // Bits: IS_BODY, IS_UNIFORM, IS_OF_PLANES.
    kind: u32,
    field_lowest: vec3<f32>,
    // Factor on n - 1 of a field.
    contrast: f32,
    field_nodes_per_unit: vec3<f32>,
    // Largest index of the field.
    largest: f32,
    field_nodes: vec3<u32>,
    // Where coefficients and distances lie: of the level set, of the field, and in bytes of the cells without surface.
    surface: u32,
    field: u32,
    clearance: u32,
    // How many planes enclose the body or cut its level set, and where the first of them lies.
    planes: u32,
    first_plane: u32,
}

const IS_BODY: u32 = 1u;
const IS_UNIFORM: u32 = 2u;
const IS_OF_PLANES: u32 = 4u;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> scene: Scene;
@group(0) @binding(2) var<uniform> task: Task;
@group(0) @binding(3) var<uniform> regions: array<Region, MOST_REGIONS>;
@group(0) @binding(4) var<storage, read> table: array<i32>;
@group(0) @binding(5) var<storage, read> forward: array<u32>;
@group(0) @binding(6) var<storage, read> occupied: array<u32>;
@group(0) @binding(7) var<storage, read> density: array<f32>;
@group(0) @binding(8) var<storage, read> colours: array<u32>;
@group(0) @binding(9) var<storage, read> texels: array<f32>;
// Scales of colours, planes, then coefficients of level sets and fields.
@group(0) @binding(10) var<storage, read> numbers: array<f32>;
@group(0) @binding(11) var<storage, read> clearances: array<u32>;

// Four coefficients of colour of a voxel.
fn colour_at(voxel: u32, block: u32) -> vec4<f32> {
    let at = 4u * block;
    let scale = vec4<f32>(numbers[at], numbers[at + 1u], numbers[at + 2u], numbers[at + 3u]);
    return unpack4x8snorm(colours[voxel * BLOCKS + block]) * scale;
}
