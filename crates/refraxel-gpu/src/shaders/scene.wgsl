// What every kernel knows of the scene and of its task, and which invocation it is.

// The field's place in the world, and its background. The fields are those of `field::Scene` in Rust.
struct Scene {
    // Of the box; the eye of a projective grid.
    center: vec3<f32>,
    // Largest coordinate of the normalised, contracted space: 1 or 2.
    reach: f32,
    // Of a projective grid, one over half the widths of x/z and y/z, and twice the nearest depth.
    unit_per_world: vec3<f32>,
    // 40/L of theory (3.5) [1 / scene unit].
    density_scale: f32,
    nodes_per_unit: vec3<f32>,
    // Edge of a voxel inside the box [scene unit].
    voxel: f32,
    // The box that clips rays; of a contracted domain the far one; of a projective one, the lowest and highest x/z, y/z and z.
    lowest: vec3<f32>,
    // How far the grid reaches: 0, CONTRACTED or PROJECTIVE.
    extent: u32,
    highest: vec3<f32>,
    // Slots of the map, the empty one included.
    slots: u32,
    last_cell: vec3<u32>,
    // Rows of the environment map; 0 for a constant background.
    rows: u32,
    brick_strides: vec3<u32>,
    padding_0: u32,
    // Bricks per axis.
    bricks: vec3<u32>,
    padding_1: u32,
    // The constant background.
    plain: vec3<f32>,
    padding_2: u32,
    // The axes of a projective grid.
    right: vec3<f32>,
    padding_3: u32,
    down: vec3<f32>,
    padding_4: u32,
    ahead: vec3<f32>,
    padding_5: u32,
}

// What a dispatch does. The fields are those of `task::Task` in Rust.
struct Task {
    rays: u32,
    // Bits: WANTS_FIELD, WANTS_RAYS, GIVEN_BEHIND.
    wants: u32,
    // Quadrature step inside the box [scene unit].
    step: f32,
    near: f32,
    // Samples of lower raw density are transparent.
    theta_min: f32,
    min_transmittance: f32,
    sample_colour: f32,
    tv_density: f32,
    tv_colour: f32,
    tv_period: u32,
    // Number of the step modulo tv_period.
    tv_turn: u32,
    rate_density: f32,
    rate_colour: f32,
    rate_view: f32,
    rate_background: f32,
    // Where the outcome of the step goes.
    outcome: u32,
    // Samples of smaller optical depth are left out by chance.
    thin: f32,
    // Samples nearer to the camera move the field by less, theory (4.29).
    full_distance: f32,
    padding_0: u32,
    padding_1: u32,
}

// The number of an invocation in a dispatch of one or two dimensions.
fn invocation(group: vec3<u32>, groups: vec3<u32>, lane: u32) -> u32 {
    return (group.x + group.y * groups.x) * WORKGROUP + lane;
}

// Neither infinite nor NaN, told from the bits: a compiler may assume that comparisons never see either.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}
