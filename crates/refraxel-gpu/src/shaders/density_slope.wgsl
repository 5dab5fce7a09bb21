// The gradient of raw density at a sample of a straight ray.

// The raw densities around a sample.
fn densities(s: ptr<function, Sample>) -> array<f32, 8> {
    let corner = (*s).corner;
    return array<f32, 8>(
        density[corner[0]], density[corner[1]], density[corner[2]], density[corner[3]],
        density[corner[4]], density[corner[5]], density[corner[6]], density[corner[7]],
    );
}

// h ∇θ at the place of a sample.
fn density_slope(s: ptr<function, Sample>, x: vec3<f32>) -> vec3<f32> {
    return node_vjp(x, trilinear_gradient((*s).fraction, densities(s))) * scene.voxel;
}
