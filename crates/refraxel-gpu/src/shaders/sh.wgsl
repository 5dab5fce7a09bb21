// Real spherical harmonics, theory (3.6), in the order of `sh.rs` of refraxel-core; DEGREE is that of the field.

fn sh_basis(d: vec3<f32>) -> array<f32, MAX_BASIS> {
    var y = array<f32, MAX_BASIS>();
    y[0] = SH_C0;
    if (DEGREE == 0u) {
        return y;
    }
    y[1] = -SH_C1 * d.y;
    y[2] = SH_C1 * d.z;
    y[3] = -SH_C1 * d.x;
    if (DEGREE == 1u) {
        return y;
    }
    let q = d * d;
    y[4] = SH_C2_0 * d.x * d.y;
    y[5] = -SH_C2_0 * d.y * d.z;
    y[6] = SH_C2_1 * (2.0 * q.z - q.x - q.y);
    y[7] = -SH_C2_0 * d.x * d.z;
    y[8] = SH_C2_2 * (q.x - q.y);
    if (DEGREE == 2u) {
        return y;
    }
    y[9] = -SH_C3_0 * d.y * (3.0 * q.x - q.y);
    y[10] = SH_C3_1 * d.x * d.y * d.z;
    y[11] = -SH_C3_2 * d.y * (4.0 * q.z - q.x - q.y);
    y[12] = SH_C3_3 * d.z * (2.0 * q.z - 3.0 * q.x - 3.0 * q.y);
    y[13] = -SH_C3_2 * d.x * (4.0 * q.z - q.x - q.y);
    y[14] = SH_C3_5 * d.z * (q.x - q.y);
    y[15] = -SH_C3_0 * d.x * (q.x - 3.0 * q.y);
    return y;
}

// Transpose of the derivative of the basis, as polynomials of the free vector d, theory (3.14).
fn sh_basis_vjp(d: vec3<f32>, d_y: array<f32, MAX_BASIS>) -> vec3<f32> {
    if (DEGREE == 0u) {
        return vec3<f32>(0.0);
    }
    let q = d * d;
    var g = vec3<f32>(-SH_C1 * d_y[3], -SH_C1 * d_y[1], SH_C1 * d_y[2]);
    if (DEGREE >= 2u) {
        g += vec3<f32>(d.y, d.x, 0.0) * (SH_C2_0 * d_y[4]);
        g -= vec3<f32>(0.0, d.z, d.y) * (SH_C2_0 * d_y[5]);
        g += vec3<f32>(-2.0 * d.x, -2.0 * d.y, 4.0 * d.z) * (SH_C2_1 * d_y[6]);
        g -= vec3<f32>(d.z, 0.0, d.x) * (SH_C2_0 * d_y[7]);
        g += vec3<f32>(2.0 * d.x, -2.0 * d.y, 0.0) * (SH_C2_2 * d_y[8]);
    }
    if (DEGREE >= 3u) {
        g -= vec3<f32>(6.0 * d.x * d.y, 3.0 * q.x - 3.0 * q.y, 0.0) * (SH_C3_0 * d_y[9]);
        g += vec3<f32>(d.y * d.z, d.x * d.z, d.x * d.y) * (SH_C3_1 * d_y[10]);
        g -= vec3<f32>(-2.0 * d.x * d.y, 4.0 * q.z - q.x - 3.0 * q.y, 8.0 * d.y * d.z) * (SH_C3_2 * d_y[11]);
        g += vec3<f32>(-6.0 * d.x * d.z, -6.0 * d.y * d.z, 6.0 * q.z - 3.0 * q.x - 3.0 * q.y) * (SH_C3_3 * d_y[12]);
        g -= vec3<f32>(4.0 * q.z - 3.0 * q.x - q.y, -2.0 * d.x * d.y, 8.0 * d.x * d.z) * (SH_C3_2 * d_y[13]);
        g += vec3<f32>(2.0 * d.x * d.z, -2.0 * d.y * d.z, q.x - q.y) * (SH_C3_5 * d_y[14]);
        g -= vec3<f32>(3.0 * q.x - 3.0 * q.y, -6.0 * d.x * d.y, 0.0) * (SH_C3_0 * d_y[15]);
    }
    return g;
}
