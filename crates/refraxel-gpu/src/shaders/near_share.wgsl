// Share by which a sample at this distance from the camera moves the field, theory (4.29).
fn near_share(t: f32) -> f32 {
    let part = t / task.full_distance;
    return select(1.0, part * part, t < task.full_distance);
}
