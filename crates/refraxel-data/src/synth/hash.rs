//! Numbers that look random and depend on nothing but their arguments, so that any thread may draw them in any order.

/// Mixes a seed and a counter into 64 well-spread bits (the finaliser of SplitMix64, Steele et al. 2014).
#[inline]
pub(super) fn mix(seed: u64, counter: u64) -> u64 {
    let mut z = seed ^ counter.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The upper 53 bits as a number in [0, 1).
#[inline]
pub(super) fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// Bits of a lattice cell.
#[inline]
pub(super) fn cell(seed: u64, i: [i64; 3]) -> u64 {
    let packed =
        (i[0] as u64 & 0x1f_ffff) | (i[1] as u64 & 0x1f_ffff) << 21 | (i[2] as u64 & 0x1f_ffff) << 42;
    mix(seed, packed)
}

/// A number in [−1, 1), the same for the same arguments.
pub(super) fn signed(seed: u64, draw: u64) -> f64 {
    2.0 * unit(mix(seed, draw)) - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_fill_the_unit_interval_evenly() {
        let n = 20_000;
        let mean = (0..n).map(|i| unit(mix(7, i))).sum::<f64>() / n as f64;
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0_f64 / n as f64).sqrt()); // four standard errors
        assert_ne!(cell(1, [0, 0, 1]), cell(1, [0, 1, 0]));
    }
}
