// A batch that is drawn from photographs on the device: the pixels that `RaySampler` of the trainer chooses, by the same random numbers.

// A pixel of a view; NONE in place of the view: none was found.
struct Place {
    view: u32,
    pixel: u32,
}

@compute @workgroup_size(WORKGROUP)
fn draw(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let ray = invocation(group, groups, lane);
    if (ray >= task.rays) {
        return;
    }
    let place = chosen(ray);
    if (place.view == NONE) {
        lessons[ray] = Lesson();
        lessons[ray].is_absent = 1u;
        atomicAdd(&status[STATUS_ABSENT], 1u);
        return;
    }
    lessons[ray] = lesson_of(ray, place);
}

fn lesson_of(ray: u32, place: Place) -> Lesson {
    let view = place.view;
    let origin = views[view].origin;
    let d = camera_direction(view, place.pixel);
    let direction = normalize(views[view].right * d.x + views[view].down * d.y + views[view].forward * d.z);
    var behind = vec3<f32>(0.0);
    if (selection.transparent != 0u) {
        behind = vec3<f32>(random_unit(ray, 0u), random_unit(ray, 1u), random_unit(ray, 2u));
    }
    let colour = mean_colour(view, place.pixel, behind);
    let offset = random_unit(ray, OFFSET_LANE);
    let bends = u32(admits(origin, direction));
    let beside = u32(is_beside(view, place.pixel));
    return Lesson(origin, offset, direction, bends, colour, beside, behind, 0u);
}

// The colour of a pixel, before something where photographs are transparent, else of common exposure.
fn shown_colour(view: u32, pixel: u32, behind: vec3<f32>) -> vec3<f32> {
    let colour = colour_of(view, pixel);
    if (selection.transparent == 0u) {
        return through(filter_of(views[view].thickness), colour);
    }
    var alpha = 1.0;
    if (views[view].channels == 4u) {
        alpha = channel(view, pixel, 3u);
    }
    return colour * alpha + behind * (1.0 - alpha);
}

// The mean over a window of what lies on the pixel's side of the border of what is refractive, theory (4.26).
fn mean_colour(view: u32, pixel: u32, behind: vec3<f32>) -> vec3<f32> {
    let reach = i32(selection.reach);
    if (reach == 0) {
        return shown_colour(view, pixel, behind);
    }
    let size = vec2<i32>(i32(views[view].width), i32(views[view].height));
    let at = vec2<i32>(i32(pixel) % size.x, i32(pixel) / size.x);
    let last = min(2 * reach + 1, i32(TAPS)) - 1;
    let inside = is_inside(view, pixel);
    var sum = vec3<f32>(0.0);
    var count = 0.0;
    for (var y = 0; y <= last; y++) {
        for (var x = 0; x <= last; x++) {
            let p = at + (2 * vec2<i32>(x, y) - last) * reach / last;
            if (any(p < vec2<i32>(0)) || any(p >= size)) {
                continue;
            }
            let tap = u32(p.y * size.x + p.x);
            if (is_usable(view, tap) && is_inside(view, tap) == inside) {
                let colour = max(shown_colour(view, tap, behind), vec3<f32>(0.0));
                sum += colour * colour;
                count += 1.0;
            }
        }
    }
    return sqrt(sum / count);
}

fn chosen(ray: u32) -> Place {
    for (var k = 0u; k < REDRAWS; k++) {
        var place: Place;
        if (ray < selection.from_inside) {
            place = inside_pixel(number_below(selection.inside, k, ray, ray, selection.from_inside));
        } else {
            let among = ray - selection.from_inside;
            place = any_pixel(number_below(selection.pixels, k, ray, among, task.rays - selection.from_inside));
        }
        if (is_selected(place)) {
            return place;
        }
    }
    return Place(NONE, 0u);
}

// The first choice of a ray is the number whose turn it is among so many rays, others are random.
fn number_below(n: u32, choice: u32, ray: u32, among: u32, rays: u32) -> u32 {
    if (choice == 0u) {
        return turn(n, among, rays);
    }
    return random_below(n, ray, PIXEL_LANE + choice);
}

fn is_selected(place: Place) -> bool {
    let view = place.view;
    if (views[view].is_aside != 0u) {
        return false;
    }
    if (!is_usable(view, place.pixel)) {
        return false;
    }
    if (all(camera_direction(view, place.pixel) == vec3<f32>(0.0))) {
        return false;
    }
    return selection.margin == NONE || is_clearly_outside(view, place.pixel, selection.margin);
}

// Pixel number `at` of all.
fn any_pixel(at: u32) -> Place {
    var view = 0u;
    var end = selection.views;
    while (end - view > 1u) {
        let middle = (view + end) / 2u;
        if (views[middle].first <= at) {
            view = middle;
        } else {
            end = middle;
        }
    }
    return Place(view, at - views[view].first);
}

// Pixel number `at` of those inside refractive masks. `marks` begins with the number of such pixels before each row.
fn inside_pixel(at: u32) -> Place {
    var row = 0u;
    var end = selection.rows;
    while (end - row > 1u) {
        let middle = (row + end) / 2u;
        if (marks[middle] <= at) {
            row = middle;
        } else {
            end = middle;
        }
    }
    var view = 0u;
    end = selection.views;
    while (end - view > 1u) {
        let middle = (view + end) / 2u;
        if (views[middle].first_row <= row) {
            view = middle;
        } else {
            end = middle;
        }
    }
    let y = row - views[view].first_row;
    return Place(view, y * views[view].width + column_of(at - marks[row], views[view].mask + y * row_words(view)));
}

// Where the bit stands that has `before` others before it in a row of a plane.
fn column_of(before: u32, first: u32) -> u32 {
    var left = before;
    var word = 0u;
    while (countOneBits(marks[first + word]) <= left) {
        left -= countOneBits(marks[first + word]);
        word++;
    }
    var bits = marks[first + word];
    while (left > 0u) {
        bits &= bits - 1u;
        left--;
    }
    return 32u * word + firstTrailingBit(bits);
}
