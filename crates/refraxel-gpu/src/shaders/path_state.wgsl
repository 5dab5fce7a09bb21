// From one dispatch to the next.

// Where the path of a ray stands.
fn standing(ray: u32) -> Checkpoint {
    let c = checkpoints[place_of(0u, ray)];
    if (c.stage != 0u) {
        return c;
    }
    var tracer = path_of(ray);
    var front = front_of(lessons[ray].offset);
    return checkpoint_of(&tracer, &front, first_sight(ray), GOES_ON);
}

// Note where it stands after as many segments as one dispatch takes, or at its end, of which the host is told; whether it is over.
fn stand(ray: u32, t: ptr<function, Tracer>, front: ptr<function, Front>, sight: Sight, ends: bool) -> bool {
    let over = ends || (*t).ended || (*t).segments >= bending.most_segments;
    checkpoints[place_of(0u, ray)] = checkpoint_of(t, front, sight, select(GOES_ON, OVER, over));
    if (over) {
        atomicAdd(&status[STATUS_OVER], 1u);
        atomicMax(&status[STATUS_LONGEST], (*t).segments);
    }
    if (is_cut_short()) {
        atomicOr(&status[STATUS_CUT], 1u);
    }
    return over;
}
