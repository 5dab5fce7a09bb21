// Photographs that are kept on the device, and which of their pixels a batch draws from.

// The fields are those of `photographs::Selection` in Rust.
struct Selection {
    // What the random numbers of the batch have in common, 64 bits.
    stream: vec2<u32>,
    // The same of those that say where rays begin to take turns.
    beginnings: vec2<u32>,
    // So many rays, the first ones, are drawn inside refractive masks alone, which have so many pixels.
    from_inside: u32,
    inside: u32,
    pixels: u32,
    views: u32,
    // Rows of all refractive masks.
    rows: u32,
    // Pixels as far as this from refractive ones are left out; NONE: none are.
    margin: u32,
    // Regions whose gates say which rays bend.
    regions: u32,
    // Photographs are transparent, before random colours.
    transparent: u32,
    // Half the width of the window over which colours are averaged [pixel].
    reach: u32,
    // How far round they have gone, in 2⁻³² of their ranges.
    turned: u32,
}

// A photograph and its camera. The fields are those of `photographs::View` in Rust.
struct View {
    // Axes of the camera in the world.
    right: vec3<f32>,
    // Pixels of the views before.
    first: u32,
    down: vec3<f32>,
    width: u32,
    forward: vec3<f32>,
    height: u32,
    origin: vec3<f32>,
    // Where its pixels lie [word].
    pixels: u32,
    focal: vec2<f32>,
    center: vec2<f32>,
    // What gives it common exposure: an optical thickness.
    thickness: vec3<f32>,
    is_aside: u32,
    channels: u32,
    // Channels are numbers in f32, not bytes.
    is_real: u32,
    // Where the table of its directions lies [word]; NONE: it has a pinhole.
    directions: u32,
    // The plane of bits of the pixels that may be used; NONE: all may.
    usable: u32,
    // Planes of bits of the pixels inside its refractive mask, and of those beside it; NONE: it has no mask.
    mask: u32,
    // Rows of the masks before.
    first_row: u32,
    padding_0: u32,
    padding_1: u32,
}

// One channel of a pixel [1, a code].
fn channel(view: u32, pixel: u32, number: u32) -> f32 {
    let at = pixel * views[view].channels + number;
    if (views[view].is_real != 0u) {
        return bitcast<f32>(photograph_word(views[view].pixels + at));
    }
    let word = photograph_word(views[view].pixels + (at >> 2u));
    return f32((word >> (8u * (at & 3u))) & 255u) / 255.0;
}

fn colour_of(view: u32, pixel: u32) -> vec3<f32> {
    return vec3<f32>(channel(view, pixel, 0u), channel(view, pixel, 1u), channel(view, pixel, 2u));
}

// The direction of a pixel in the frame of its camera, not normalised; 0 where the lens sees nothing.
fn camera_direction(view: u32, pixel: u32) -> vec3<f32> {
    let table = views[view].directions;
    if (table == NONE) {
        let width = views[view].width;
        let at = vec2<f32>(f32(pixel % width), f32(pixel / width)) + 0.5;
        return vec3<f32>((at - views[view].center) / views[view].focal, 1.0);
    }
    let word = table + 3u * pixel;
    return vec3<f32>(
        bitcast<f32>(photograph_word(word)),
        bitcast<f32>(photograph_word(word + 1u)),
        bitcast<f32>(photograph_word(word + 2u)),
    );
}

// Words of a row of a plane of bits.
fn row_words(view: u32) -> u32 {
    return (views[view].width + 31u) / 32u;
}

fn is_marked(plane: u32, view: u32, pixel: u32) -> bool {
    let x = pixel % views[view].width;
    let y = pixel / views[view].width;
    return ((marks[plane + y * row_words(view) + (x >> 5u)] >> (x & 31u)) & 1u) != 0u;
}

// Whether a mask lets a pixel count.
fn is_usable(view: u32, pixel: u32) -> bool {
    return views[view].usable == NONE || is_marked(views[view].usable, view, pixel);
}

// Whether a pixel lies inside the view's mask of what is refractive.
fn is_inside(view: u32, pixel: u32) -> bool {
    return views[view].mask != NONE && is_marked(views[view].mask, view, pixel);
}

// The plane of the pixels that show nothing refractive, of a view with a mask.
fn beside_plane(view: u32) -> u32 {
    return views[view].mask + views[view].height * row_words(view);
}

fn is_beside(view: u32, pixel: u32) -> bool {
    return views[view].mask != NONE && is_marked(beside_plane(view), view, pixel);
}

// Whether neither a pixel nor any within so many rows and columns shows something refractive.
fn is_clearly_outside(view: u32, pixel: u32, margin: u32) -> bool {
    if (views[view].mask == NONE) {
        return true;
    }
    let x = pixel % views[view].width;
    let y = pixel / views[view].width;
    let least = vec2<u32>(x - min(x, margin), y - min(y, margin));
    let most = min(vec2<u32>(x, y) + margin, vec2<u32>(views[view].width, views[view].height) - 1u);
    for (var row = least.y; row <= most.y; row++) {
        let first = beside_plane(view) + row * row_words(view);
        for (var word = least.x >> 5u; word <= most.x >> 5u; word++) {
            let low = select(0u, least.x & 31u, word == least.x >> 5u);
            let high = select(31u, most.x & 31u, word == most.x >> 5u);
            let asked = (0xffffffffu << low) & (0xffffffffu >> (31u - high));
            if ((~marks[first + word] & asked) != 0u) {
                return false;
            }
        }
    }
    return true;
}
