// Index samples: adjoints of the index or of a level set at a point, theory (2.16). Those of a segment wait in a short list, so that
// the code that adds them to the gradient exists once.

// What learns from the path at hand: what it meets surfaces seldom enough for.
var<private> teaches_index: bool;
var<private> teaches_surface: bool;

// How much smaller a sample counts; 0 where the derivative of the path overflowed, which says nothing.
fn clipped(region: u32, d_value: f32, d_gradient: vec3<f32>) -> f32 {
    let slope = length(d_gradient);
    if (!is_finite(slope) || !is_finite(d_value)) {
        atomicAdd(&status[STATUS_OVERFLOWS], 1u);
        return 0.0;
    }
    // What a smooth transition mirrors depends on w itself.
    let of_value = select(0.0, abs(d_value) * lattices[2u * region].voxel, regions[region].body == NO_BODY);
    let size = max(slope, of_value);
    return select(1.0, bending.clip / size, size > bending.clip);
}

struct IndexSample {
    x: vec3<f32>,
    d_value: f32,
    d_gradient: vec3<f32>,
    // That of the index of the region, or of its level set.
    lattice: u32,
}

// At most four wait: of the kick of a segment, of both sides of the surface at its end, and of that.
var<private> waiting: array<IndexSample, 4>;
var<private> waiting_samples: u32;

fn wait_for(sample: IndexSample) {
    waiting[waiting_samples] = sample;
    waiting_samples++;
}

// dLoss/dw and dLoss/d(∇w) of a region at a point.
fn add_index_sample(region: u32, x: vec3<f32>, d_value: f32, d_gradient: vec3<f32>) {
    if (teaches_index) {
        wait_for(IndexSample(x, d_value, d_gradient, 2u * region));
    }
}

// dLoss/dφ and dLoss/d(∇φ) of a body at a point.
fn add_level_sample(region: u32, x: vec3<f32>, d_value: f32, d_gradient: vec3<f32>) {
    if (teaches_surface) {
        wait_for(IndexSample(x, d_value, d_gradient, 2u * region + 1u));
    }
}

// Of a body of flat faces the gradient begins with four numbers for each plane: by its normal, turned about the middle of the box, and by
// its height there. Planes that cut the body off, and those that cut a spline, receive nothing.
fn scatter_facet(region: u32, x: vec3<f32>, g: vec3<f32>, d_value: f32, d_gradient: vec3<f32>) {
    let which = highest_facet(region, g);
    if (which + CUTS >= regions[region].planes) {
        return;
    }
    let lattice = lattices[2u * region + 1u];
    let middle = lattice.lowest + 0.5 * vec3<f32>(lattice.nodes - 1u) / lattice.scale;
    let d_normal = (x - middle) * d_value + d_gradient;
    let first = lattice.first + 4u * which;
    add_index_gradient(first, d_normal.x);
    add_index_gradient(first + 1u, d_normal.y);
    add_index_gradient(first + 2u, d_normal.z);
    add_index_gradient(first + 3u, d_value);
}

// Add what waits to the gradient of the coefficients.
fn scatter_samples() {
    for (var k = 0u; k < waiting_samples; k++) {
        let s = waiting[k];
        let region = s.lattice / 2u;
        let scale = clipped(region, s.d_value, s.d_gradient);
        let g = lattice_node(s.lattice, s.x);
        var at = IndexCell(vec3<u32>(0u), false);
        var interpolation = CUBIC_B_SPLINE;
        // The border belongs to the coefficients of a body's own field.
        var border = false;
        if (s.lattice % 2u == 0u) {
            at = index_cell(region, g);
            interpolation = regions[region].interpolation;
            border = regions[region].body != NO_BODY;
        } else if (lattice_holds(s.lattice, g)) {
            at.cell = lattice_cell(s.lattice, g);
            at.found = !is_rim(s.lattice, at.cell) && is_of_spline(region, g);
        }
        let is_faceted = s.lattice % 2u == 1u && regions[region].body == BODY_OF_PLANES;
        if (is_faceted && scale > 0.0) {
            scatter_facet(region, s.x, g, s.d_value * scale, s.d_gradient * scale);
        } else if (scale > 0.0 && at.found) {
            let d_force = s.d_gradient * (scale * lattices[s.lattice].scale);
            scatter_stencil(s.lattice, interpolation, at.cell, g, s.d_value * scale, d_force, border);
        }
    }
    waiting_samples = 0u;
}
