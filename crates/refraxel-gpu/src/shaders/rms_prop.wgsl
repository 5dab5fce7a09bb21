// RMSProp, theory (4.7).

// A second moment after a step, and the factor from a gradient to its step.
struct RmsProp {
    moment: f32,
    factor: f32,
}

fn rms_prop(mean_square: f32, moment: f32, rate: f32) -> RmsProp {
    let v = select(RMS_DECAY * moment + (1.0 - RMS_DECAY) * mean_square, mean_square, moment == 0.0);
    return RmsProp(v, -rate / (sqrt(v) + RMS_EPSILON));
}
