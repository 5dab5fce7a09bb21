// Radiance caches, theory (7.7) and (7.8): `probes.rs` of the core. The harmonics are those of the highest degree; caches of a lower
// one use the first of them.

// The fields are those of `probes::Cache` in Rust.
struct Cache {
    lowest: vec3<f32>,
    // Where the coefficients begin.
    first: u32,
    // Probes per scene unit.
    scale: vec3<f32>,
    // Harmonics of a probe.
    basis: u32,
    // Probes per axis.
    nodes: vec3<u32>,
    // That of the mirror.
    strength: f32,
}

// The probes around a point and the basis of a direction.
struct ProbeStencil {
    // The coefficients of the first probe of the cell.
    first: u32,
    fraction: vec3<f32>,
    // d(fraction)/dx; 0 on axes on which the point lies outside.
    scale: vec3<f32>,
    basis: array<f32, MAX_BASIS>,
}

// The cache that a reflection reads: the inner one of the region in which the ray arrives, or in vacuum the outer one of the region
// whose surface it is.
fn read_by(within: u32, region: u32) -> u32 {
    return select(2u * within + 1u, 2u * region, within == NO_REGION);
}

fn probe_stencil(cache: u32, x: vec3<f32>, d: vec3<f32>) -> ProbeStencil {
    let nodes = caches[cache].nodes;
    let last = vec3<f32>(nodes - vec3<u32>(1u));
    let g = (x - caches[cache].lowest) * caches[cache].scale;
    let inside = clamp(g, vec3<f32>(0.0), last);
    let cell = min(vec3<u32>(inside), nodes - vec3<u32>(2u));
    let probe = cell.x + nodes.x * (cell.y + nodes.y * cell.z);
    let scale = select(vec3<f32>(0.0), caches[cache].scale, inside == g);
    return ProbeStencil(caches[cache].first + 3u * caches[cache].basis * probe, inside - vec3<f32>(cell), scale, sh_basis(d));
}

// Where the coefficients of a corner of the cell begin.
fn probe_of(cache: u32, s: ptr<function, ProbeStencil>, k: u32) -> u32 {
    let nodes = caches[cache].nodes;
    let probe = (k & 1u) + nodes.x * (((k >> 1u) & 1u) + nodes.y * (k >> 2u));
    return (*s).first + 3u * caches[cache].basis * probe;
}

// Radiance before the clamp at 0.
fn radiance_at(cache: u32, s: ptr<function, ProbeStencil>) -> vec3<f32> {
    let n = caches[cache].basis;
    var sum = vec3<f32>(0.5);
    for (var k = 0u; k < 2u * bending.taps; k++) {
        let at = probe_of(cache, s, k);
        let weight = trilinear_weight((*s).fraction, k);
        for (var j = 0u; j < n; j++) {
            sum += weight * (*s).basis[j] * vec3<f32>(probes[at + j], probes[at + n + j], probes[at + 2u * n + j]);
        }
    }
    return sum;
}
