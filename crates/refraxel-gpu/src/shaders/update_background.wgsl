// RMSProp on the values of the texels that received a gradient, theory (4.7).

@compute @workgroup_size(WORKGROUP)
fn update_background(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = invocation(group, groups, lane);
    if (i >= 6u * scene.rows * scene.rows || has_failed()) {
        return;
    }
    let g = take_texel_gradient(i);
    if (g == 0.0) {
        return;
    }
    let step = rms_prop(g * g, texel_moment[i], task.rate_background);
    texel_moment[i] = step.moment;
    texels[i] += g * step.factor;
}

fn has_failed() -> bool {
    return (status[STATUS_FAILED] | status[STATUS_LOSS] | status[STATUS_PARAMETER]) != 0u;
}
