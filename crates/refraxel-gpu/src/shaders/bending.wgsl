// What a dispatch on rays that may bend or be mirrored has to know beyond its task. The fields are those of `bending::Bending` in Rust.
struct Bending {
    // The rays from `first` on, so many of them.
    first: u32,
    rays: u32,
    // Paths are long: only so many rays keep theirs at a time.
    keeps: u32,
    // Surfaces and the index learn from paths that meet surfaces at most this often.
    surface_events: u32,
    index_events: u32,
    // Weight of the squared error of rays that bend.
    weight: f32,
    // Bound on the adjoint of an index sample.
    clip: f32,
    // Where the gradient of absorption coefficients lies behind that of the index.
    absorption_from: u32,
    // Coefficients per axis that a cell depends on: 4, which no compiler knows.
    taps: u32,
    regions: u32,
    // Weight of the depth at which rays beside masks pass through a body [1 / voxel of its level set].
    silhouette: f32,
    // Segments that one dispatch takes a path further, or back.
    replay: u32,
    // Segments that a path may have.
    most_segments: u32,
    // Whether some region has no sharp surface.
    is_smooth: u32,
    // Where the gradient of the strengths of mirrors lies behind that of the probes.
    strengths_from: u32,
    // Samples of at most this weight do not count for a clearcoat, whose index of refraction comes next.
    least_weight: f32,
    coat_index: f32,
}

// Some devices leave all loops of an invocation after a number of iterations, without a word. An invocation asks at its end
// whether that has happened: then this loop ends early, too.
fn is_cut_short() -> bool {
    var turns = 0u;
    while (turns < bending.taps) {
        turns++;
    }
    return turns < bending.taps;
}
