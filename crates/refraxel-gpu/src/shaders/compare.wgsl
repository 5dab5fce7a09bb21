// What rays that may bend owe to their targets.

// dLoss/d(what a ray shows), given where its path ends. One that bends beside a mask counts whole: the body is wrong there, not what
// stands around it.
fn d_colour_of(ray: u32, end: Checkpoint) -> vec3<f32> {
    let exit = exit_of(ray, end.p);
    let turns = lessons[ray].bends != 0u && (end.events > 0u || dot(lessons[ray].direction, exit) < STRAIGHT);
    let residual = seen[ray].colour - lessons[ray].colour;
    return 2.0 * select(1.0, bending.weight, turns && lessons[ray].beside == 0u) * residual;
}

// What learns from a path: what it meets surfaces seldom enough for.
fn choose_what_learns(ray: u32, end: Checkpoint) {
    let wants_index = lessons[ray].bends != 0u && (task.wants & WANTS_INDEX) != 0u;
    teaches_index = wants_index && end.events <= bending.index_events;
    teaches_surface = wants_index && end.events <= bending.surface_events;
}
