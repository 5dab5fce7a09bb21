// Integers of 64 bits as two words, the lower first. Overflow wraps.

fn wide_sum(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = a.x + b.x;
    return vec2<u32>(low, a.y + b.y + select(0u, 1u, low < a.x));
}

// The whole product of two words, from those of their halves.
fn whole_product(a: u32, b: u32) -> vec2<u32> {
    let x = vec2<u32>(a & 0xffffu, a >> 16u);
    let y = vec2<u32>(b & 0xffffu, b >> 16u);
    let low = x.x * y.x;
    let one = x.x * y.y;
    let other = x.y * y.x;
    let middle = (low >> 16u) + (one & 0xffffu) + (other & 0xffffu);
    let high = x.y * y.y + (one >> 16u) + (other >> 16u) + (middle >> 16u);
    return vec2<u32>((low & 0xffffu) | (middle << 16u), high);
}

fn wide_product(a: vec2<u32>, b: vec2<u32>) -> vec2<u32> {
    let low = whole_product(a.x, b.x);
    return vec2<u32>(low.x, low.y + a.x * b.y + a.y * b.x);
}

// For 0 < by < 32.
fn shifted_right(a: vec2<u32>, by: u32) -> vec2<u32> {
    return vec2<u32>((a.x >> by) | (a.y << (32u - by)), a.y >> by);
}
