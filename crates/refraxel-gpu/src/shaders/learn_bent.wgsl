// Compare rays that may bend with their targets, and the adjoint of all that they met, theory (2.15)–(2.30), (3.10)–(3.14) and
// (7.19), (7.20). `render_bent` has run before, and where surfaces mirror `mirror` and `mirror_vjp`: `seen` holds what rays show,
// `checkpoints` where their paths stand before every block of `replay` segments. Each dispatch takes the last of these blocks that is left: segments are traced and marched again, from
// the front, and kept in `steps`; then the adjoint of the path goes back over them.

// Where the way back along a path stands.
struct WayBack {
    // dLoss/d(x, p).
    d_x: vec3<f32>,
    // Blocks that are left.
    blocks: u32,
    d_p: vec3<f32>,
    // 0 before the first dispatch, then GOES_ON or OVER.
    stage: u32,
    // dLoss/d(thickness) of all that lies behind.
    d_behind: vec3<f32>,
    region: u32,
    middle: vec3<f32>,
    is_known: u32,
    trespass: vec3<f32>,
    transmittance: f32,
}

// What the samples of a section of a ray have to know of it.
struct Blame {
    // What the section and all behind it show, and dLoss/d(that), for a transmittance of 1 before the section.
    shown: vec3<f32>,
    d_colour: vec3<f32>,
    // 2 λ_c of theory (4.5) and what draws the colours of samples, the target of the ray.
    draws: f32,
    target_colour: vec3<f32>,
    // Where the ray starts.
    eye: vec3<f32>,
    // Segments receive gradients.
    of_segments: bool,
}

// What a segment receives from the samples on it.
struct Received {
    d: SegmentAdjoint,
    d_thickness: vec3<f32>,
    d_moment: vec3<f32>,
}

// The first way of a path through a body, as far as it is known while the path is followed back.
struct Trespass {
    // The middle of the segment that was met last.
    middle: vec3<f32>,
    is_known: bool,
    // The middle of the way, the body and the transmittance in front of it.
    x: vec3<f32>,
    region: u32,
    transmittance: f32,
}

// Takes note of the segment before.
fn follow(t: ptr<function, Trespass>, s: Step) {
    if (s.event != 0u && (s.event & FROM_INSIDE) == 0u && (*t).is_known) {
        (*t).x = (*t).middle;
        (*t).region = s.surface;
        (*t).transmittance = s.transmittance;
    }
    (*t).middle = s.start + s.momentum * (0.5 * s.drift);
    (*t).is_known = true;
}

// What a path owes that should have missed the first body that it meets, theory (4.22).
fn add_trespass(t: Trespass) {
    if (t.region != NO_REGION && level_sample(t.region, t.x).w < 0.0) {
        let weight = bending.silhouette * t.transmittance / lattices[2u * t.region + 1u].voxel;
        add_level_sample(t.region, t.x, -weight, vec3<f32>(0.0));
    }
}

@compute @workgroup_size(WORKGROUP)
fn learn_bent(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let number = invocation(group, groups, lane);
    if (number >= bending.rays) {
        return;
    }
    let ray = bending.first + number;
    var way = ways[number];
    if (way.stage == OVER || !is_followed(ray)) {
        return;
    }
    let whole = seen[ray];
    let residual = whole.colour - lessons[ray].colour;
    let squared_error = dot(residual, residual);
    if (!is_finite(squared_error)) {
        atomicOr(&status[STATUS_LOSS], 1u);
        return;
    }
    let end = checkpoints[place_of(0u, ray)];
    let d_colour = d_colour_of(ray, end);
    if (way.stage == 0u) {
        add_status(STATUS_ERROR / 2u, squared_error);
        way = way_from(ray, end, whole, d_colour);
    }
    look_back(ray, end, d_colour, &way);
    ways[number] = way;
    if (way.stage == OVER && (task.wants & WANTS_RAYS) != 0u) {
        ray_gradients[ray] = RayGradient(way.d_x, 0.0, way.d_p, 0.0, residual, 0.0);
    }
    if (is_cut_short()) {
        atomicOr(&status[STATUS_CUT], 1u);
    }
}

// The way back from the end of a path.
fn way_from(ray: u32, end: Checkpoint, whole: Seen, d_colour: vec3<f32>) -> WayBack {
    var way = WayBack();
    way.stage = GOES_ON;
    way.blocks = (end.segments + bending.replay - 1u) / bending.replay;
    way.region = NO_REGION;
    let exit = exit_of(ray, end.p);
    var d_shown = whole.transmittance * d_colour;
    var d_thickness = vec3<f32>(0.0);
    if (is_surface(end.mirror)) {
        d_shown = whole.transmittance * reflections[end.mirror].d_behind;
        if (reflections[end.mirror].segment + 1u == end.segments) {
            d_thickness = reflections[end.mirror].d_thickness;
        }
    }
    if (absorbs()) {
        let behind = filtered(filter_of(end.thickness), whole.behind);
        way.d_behind = d_thickness + d_shown * behind.by_thickness;
        d_shown *= behind.slope;
    }
    if ((task.wants & GIVEN_BEHIND) == 0u) {
        scatter_background(exit, d_shown);
        let free = background_radiance_vjp(exit, d_shown);
        way.d_p = free - exit * dot(exit, free);
    }
    if (lessons[ray].bends != 0u && end.segments > 0u) {
        way.d_p = exit_vjp(end.p, way.d_p).p;
    }
    return way;
}

// Over one block, towards the camera; over the first, dLoss/d(origin, direction) is what is left.
fn look_back(ray: u32, end: Checkpoint, d_colour: vec3<f32>, way: ptr<function, WayBack>) {
    let bends = lessons[ray].bends != 0u;
    choose_what_learns(ray, end);
    let traces = (task.wants & WANTS_RAYS) != 0u || teaches_index || teaches_surface;
    let draws = select(2.0 * task.sample_colour, 0.0, lessons[ray].bends != 0u);
    var blame = Blame(seen[ray].colour, d_colour, draws, lessons[ray].colour, lessons[ray].origin, traces);
    var d = StateAdjoint((*way).d_x, (*way).d_p);
    let trespasses = lessons[ray].beside != 0u && bending.silhouette > 0.0 && teaches_surface;
    var trespass = Trespass((*way).middle, (*way).is_known != 0u, (*way).trespass, (*way).region, (*way).transmittance);
    var d_behind = (*way).d_behind;
    var k = 0u;
    if ((*way).blocks > 0u) {
        (*way).blocks--;
        k = replay((*way).blocks, ray, end.mirror, blame);
    }
    loop {
        let is_start = k == 0u;
        if (is_start) {
            if ((*way).blocks > 0u) {
                break;
            }
            (*way).stage = OVER;
            if (trespasses) {
                add_trespass(trespass);
            }
            if (bends && traces) {
                d = start_vjp(lessons[ray].origin, lessons[ray].direction, d);
            }
        } else {
            k--;
            var s = steps[k * bending.keeps + ray - bending.first];
            if (trespasses) {
                follow(&trespass, s);
            }
            var d_end = 0.0;
            if (absorbs() && s.within != NO_REGION) {
                d_end = thickness_vjp(&s, d_behind);
            }
            d_behind += s.d_thickness;
            if (bends && traces) {
                step_vjp(s, d_end, &d);
            } else {
                d = StateAdjoint(d.x + s.d_start, d.p + s.d_momentum);
            }
        }
        scatter_samples();
        if (is_start) {
            break;
        }
    }
    (*way).d_x = d.x;
    (*way).d_p = d.p;
    (*way).d_behind = d_behind;
    (*way).middle = trespass.middle;
    (*way).is_known = u32(trespass.is_known);
    (*way).trespass = trespass.x;
    (*way).region = trespass.region;
    (*way).transmittance = trespass.transmittance;
}

// Transpose of the growth of the optical thickness along a segment, theory (7.20): adds to dLoss/d(coefficients) and to
// dLoss/d(momentum), and returns dLoss/d(the length of the segment).
fn thickness_vjp(s: ptr<function, Step>, d_behind: vec3<f32>) -> f32 {
    let speed = length((*s).momentum);
    let reach = reach_of((*s).within, speed);
    let absorption = regions[(*s).within].absorption;
    // forward: thickness = before + α |p| g t at the points, and with t = τ behind
    let d_growth = d_behind * (*s).drift + (*s).d_moment;
    let d = d_growth * reach.x;
    // A path so chaotic that its length overflowed says nothing.
    if (is_finite(d.x) && is_finite(d.y) && is_finite(d.z)) {
        let at = bending.absorption_from + 3u * (*s).within;
        add_index_gradient(at, d.x);
        add_index_gradient(at + 1u, d.y);
        add_index_gradient(at + 2u, d.z);
    }
    (*s).d_momentum += (*s).momentum * (dot(d_growth, absorption) * reach.y / speed);
    return dot(d_behind, absorption) * reach.x;
}

// Trace and march the segments behind a checkpoint again, give their samples what they owe, and keep them; their number. The last
// reflection that the ray shows is `last`.
fn replay(block: u32, ray: u32, last: u32, blame: Blame) -> u32 {
    let c = checkpoints[place_of(1u + block, ray)];
    let bends = lessons[ray].bends != 0u;
    var tracer = tracer_at(c);
    var front = front_at(c);
    var sight = sight_at(c);
    var segment = Segment();
    var count = 0u;
    while (count < bending.replay && advance(&tracer, bends, &segment)) {
        let growth = thickness_growth(segment.within, length(segment.momentum));
        var of_segment = blame;
        if (is_surface(sight.mirror)) {
            of_segment.shown = reflections[sight.mirror].behind;
            of_segment.d_colour = reflections[sight.mirror].reached * reflections[sight.mirror].d_behind;
        }
        // No index moves the samples before the first bend.
        of_segment.of_segments = blame.of_segments && ((task.wants & WANTS_RAYS) != 0u || tracer.segments > 1u);
        var received = Received();
        if (!front.opaque && segment.range.x < segment.range.y) {
            received = learn_segment(&front, &sight, &segment, growth, of_segment);
        }
        sight.thickness += growth * segment.drift;
        if (mirrors()) {
            receive(&received, sight.mirror, last, tracer.segments - 1u);
        }
        // A section begins behind each surface that mirrors.
        var mirror = 0u;
        var next = next_reflection(sight.mirror, tracer.segments);
        while (next != 0u && sight.mirror != last) {
            mirror = select(0u, next, reflections[next].trend == SHARP);
            sight.collected = vec3<f32>(0.0);
            sight.through = 1.0;
            sight.mirror = next;
            next = next_reflection(next, tracer.segments);
        }
        steps[count * bending.keeps + ray - bending.first] = Step(
            segment.start, segment.kick, segment.momentum, segment.drift, received.d.start, segment.late,
            received.d.momentum, segment.within, received.d_thickness, segment.surface, received.d_moment, segment.beyond,
            segment.event, front.transmittance, mirror, 0u,
        );
        count++;
    }
    return count;
}

// Add what a segment receives from the reflections around it, but for those at sharp surfaces at its end: of the mirrored light before
// it, through what absorbs, and of smooth transitions whose first, steepest or last point is its start.
fn receive(received: ptr<function, Received>, section: u32, last: u32, segment: u32) {
    var at = section;
    if (at != last && reflections[at].next != 0u) {
        at = reflections[at].next;
    }
    // The next one, that before the section, and one that ends where the next begins.
    for (var k = 0u; k < 3u && is_surface(at); k++) {
        let is_smooth = reflections[at].trend != SHARP;
        if (reflections[at].segment + 1u == segment) {
            (*received).d_thickness += reflections[at].d_thickness;
            if (is_smooth) {
                (*received).d.start += reflections[at].d_position;
                (*received).d.momentum += reflections[at].d_p;
            }
        }
        if (is_smooth && reflections[at].first_segment == segment) {
            (*received).d.start += reflections[at].d_first;
        }
        if (is_smooth && reflections[at].last_segment == segment) {
            (*received).d.start += reflections[at].d_last;
        }
        at = reflections[at].previous;
    }
}

// The adjoint of the samples on a segment.
fn learn_segment(
    front: ptr<function, Front>,
    sight: ptr<function, Sight>,
    segment: ptr<function, Segment>,
    growth: vec3<f32>,
    blame: Blame,
) -> Received {
    let speed = length((*segment).momentum);
    let unit = (*segment).momentum / speed;
    var basis = basis_lanes(unit);
    var out = Received();
    var sums = SegmentAdjoint();
    var samples = 0u;
    var s: Sample;
    enter(front, (*segment).start, (*segment).momentum, (*segment).range);
    while (!(*front).opaque && next_sample(front, &s)) {
        samples++;
        let before = shade(s.corner, s.weight, &basis);
        var f = Filtered(before, vec3<f32>(1.0), vec3<f32>(0.0));
        if (absorbs()) {
            f = filtered(filter_of((*sight).thickness + growth * s.t), before);
        }
        let weight = (*sight).through * s.alpha;
        (*sight).collected += weight * f.colour;
        // forward: C = collected + T (1 − a) behind
        let after = (*sight).through * (1.0 - s.alpha);
        (*sight).through = after;
        let d_tau = dot(blame.d_colour, after * f.colour - (blame.shown - (*sight).collected));
        // A colour clamped at 0 has no slope.
        let drawn = blame.d_colour + blame.draws * (f.colour - blame.target_colour);
        let d_filtered = select(vec3<f32>(0.0), weight * drawn, f.colour > vec3<f32>(0.0));
        out.d_thickness += d_filtered * f.by_thickness;
        out.d_moment += d_filtered * f.by_thickness * s.t;
        let d_sample = d_filtered * f.slope;
        let d_theta = d_tau * s.slope;
        if ((task.wants & WANTS_FIELD) != 0u) {
            let share = near_share(distance((*segment).start + (*segment).momentum * s.t, blame.eye));
            scatter(&s, &basis, share * d_theta, share * d_sample);
        }
        if (blame.of_segments) {
            add_segment_adjoint(&sums, &s, &basis, Teaching((*segment).start, unit, speed, d_theta, d_tau, d_sample));
        }
    }
    atomicAdd(&status[STATUS_SAMPLES], samples);
    out.d = sums;
    return out;
}
