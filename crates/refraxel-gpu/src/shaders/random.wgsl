// Random numbers of a batch, the same bits as on the host: `random.rs` of the trainer.

// The finaliser of SplitMix64 (Steele et al. 2014).
fn mixed_bits(state: vec2<u32>) -> vec2<u32> {
    var z = wide_sum(state, WEYL);
    z = wide_product(z ^ shifted_right(z, MIX_SHIFT_0), MIX_0);
    z = wide_product(z ^ shifted_right(z, MIX_SHIFT_1), MIX_1);
    return z ^ shifted_right(z, MIX_SHIFT_2);
}

// Number `lane` of a ray.
fn random_bits(ray: u32, lane: u32) -> vec2<u32> {
    let counter = wide_sum(whole_product(ray, LANES), vec2<u32>(lane, 0u));
    return mixed_bits(wide_sum(selection.stream, wide_product(counter, WEYL)));
}

// An integer in 0..n: the upper word of bits × n / 2³².
fn random_below(n: u32, ray: u32, lane: u32) -> u32 {
    let bits = random_bits(ray, lane);
    let upper = whole_product(bits.y, n);
    return wide_sum(upper, vec2<u32>(whole_product(bits.x, n).y, 0u)).y;
}

// The integer in 0..n whose turn it is for number k of so many rays.
fn turn(n: u32, k: u32, rays: u32) -> u32 {
    let number = k % n;
    let sharing = min(rays, n);
    let share = n / sharing;
    let rest = n % sharing;
    let length = share + u32(number < rest);
    let begins = mixed_bits(wide_sum(selection.beginnings, wide_product(vec2<u32>(number, 0u), WEYL))).x;
    return number * share + min(number, rest) + whole_product(begins + selection.turned, length).y;
}

// A number in [0, 1]: the upper 53 bits as the nearest f32, the even one of two.
fn random_unit(ray: u32, lane: u32) -> f32 {
    var bits = random_bits(ray, lane) & vec2<u32>(0xfffff800u, 0xffffffffu);
    var exponent = -24;
    if (bits.y == 0u) {
        bits = vec2<u32>(0u, bits.x);
        exponent -= 32;
    }
    let zeros = countLeadingZeros(bits.y);
    if (zeros > 0u && zeros < 32u) {
        bits = vec2<u32>(bits.x << zeros, (bits.y << zeros) | (bits.x >> (32u - zeros)));
        exponent -= i32(zeros);
    }
    // 24 bits, and whether what is cut off is more than half of the last one, or half of an odd one.
    let whole = bits.y >> 8u;
    let rest = bits.y & 0xffu;
    let is_more = rest > 0x80u || (rest == 0x80u && (bits.x != 0u || (whole & 1u) != 0u));
    return f32(whole + select(0u, 1u, is_more)) * bitcast<f32>(u32(127 + exponent) << 23u);
}
