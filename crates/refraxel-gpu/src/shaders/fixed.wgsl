// Sums that do not depend on their order: fixed point of 64 bits in two words, the lower first. The lower word counts
// FIXED_STEP, the upper one 2³² of it; negative numbers are two's complements. Atomic additions to the lower word carry into
// the upper one, so that the sum of all is exact, whoever comes first.

struct Fixed {
    low: u32,
    high: u32,
}

fn negative(v: Fixed) -> Fixed {
    let low = ~v.low + 1u;
    return Fixed(low, ~v.high + select(0u, 1u, low == 0u));
}

// Truncates below FIXED_STEP; |value| < FIXED_LIMIT.
fn to_fixed(value: f32) -> Fixed {
    let scaled = min(abs(value), FIXED_LIMIT) * FIXED_UPPER;
    let whole = floor(scaled);
    let v = Fixed(u32((scaled - whole) * 4294967296.0), u32(whole));
    if (value < 0.0) {
        return negative(v);
    }
    return v;
}

fn from_fixed(v: Fixed) -> f32 {
    // The magnitude first: the words of a small negative number cancel.
    if (v.high >= 0x80000000u) {
        let m = negative(v);
        return -(f32(m.high) / FIXED_UPPER + f32(m.low) * FIXED_STEP);
    }
    return f32(v.high) / FIXED_UPPER + f32(v.low) * FIXED_STEP;
}
