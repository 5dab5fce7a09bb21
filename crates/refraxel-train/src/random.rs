//! Counter-based random numbers: a pure function of (seed, two counters), so that nothing has to be stored to resume,
//! and any thread or device gets the same numbers.

/// Step of the state of SplitMix64.
pub const WEYL: u64 = 0x9E37_79B9_7F4A_7C15;
/// Factors of its finaliser.
pub const MIX: [u64; 2] = [0xBF58_476D_1CE4_E5B9, 0x94D0_49BB_1331_11EB];
/// Right shifts of the finaliser, before, between and behind the factors [bit].
pub const MIX_SHIFTS: [u32; 3] = [30, 27, 31];

/// A seeded source of independent uniform numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Random {
    seed: u64,
}

impl Random {
    /// The source of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// 64 random bits for counters (a, b). Source: SplitMix64 finaliser (Steele et al. 2014), applied thrice.
    #[inline]
    pub fn bits(&self, a: u64, b: u64) -> u64 {
        mix(self.stream(a).wrapping_add(b.wrapping_mul(WEYL)))
    }

    /// What the numbers of all b have in common: s in bits = mix(s + b [`WEYL`]).
    #[inline]
    pub fn stream(&self, a: u64) -> u64 {
        mix(mix(self.seed) ^ a)
    }

    /// A number in [0, 1).
    #[inline]
    pub fn uniform(&self, a: u64, b: u64) -> f64 {
        (self.bits(a, b) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// An integer in 0..n (bias below n / 2⁶⁴).
    #[inline]
    pub fn below(&self, n: u64, a: u64, b: u64) -> u64 {
        ((u128::from(self.bits(a, b)) * u128::from(n)) >> 64) as u64
    }
}

fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(WEYL);
    z = (z ^ (z >> MIX_SHIFTS[0])).wrapping_mul(MIX[0]);
    z = (z ^ (z >> MIX_SHIFTS[1])).wrapping_mul(MIX[1]);
    z ^ (z >> MIX_SHIFTS[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_and_uncorrelated_between_counters() {
        let r = Random::new(9);
        let n = 20_000;
        let mean: f64 = (0..n).map(|i| r.uniform(i, 0)).sum::<f64>() / n as f64;
        let product: f64 = (0..n).map(|i| r.uniform(i, 1) * r.uniform(i, 2)).sum::<f64>() / n as f64;
        // Standard error of the mean: 0.29 / √n = 0.002.
        assert!((mean - 0.5).abs() < 0.008 && (product - 0.25).abs() < 0.008);
        assert!((0..1000).all(|i| r.below(7, i, 3) < 7));
    }
}
