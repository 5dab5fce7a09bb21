//! Counter-based random numbers: a pure function of (seed, two counters), so that nothing has to be stored to resume,
//! and any thread or device gets the same numbers.

/// Step of the state of SplitMix64.
pub const WEYL: u64 = 0x9E37_79B9_7F4A_7C15;
/// Factors of its finaliser.
pub const MIX: [u64; 2] = [0xBF58_476D_1CE4_E5B9, 0x94D0_49BB_1331_11EB];
/// Right shifts of the finaliser, before, between and behind the factors [bit].
pub const MIX_SHIFTS: [u32; 3] = [30, 27, 31];

/// The golden section of the circle, in 2⁻³² of it.
pub const GOLDEN: u32 = 0x9E37_79B9;
/// First counter of where those who take turns begin: a step that no run reaches.
const TURNS: u64 = u64::MAX;

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

    /// Which of the numbers 0..n (n > 0) it is the turn of in step `a` for number `k` of `of` that share them, theory (4.28): each has a
    /// range of its own and goes round it by golden sections, so that it has been nearly everywhere before it comes back.
    #[inline]
    pub fn turn(&self, n: u64, a: u64, k: u64, of: u64) -> u64 {
        // More of them than numbers: so many share each.
        let (k, of) = (k % n, of.min(n));
        let (share, rest) = (n / of, n % of);
        let (first, length) = (k * share + k.min(rest), share + u64::from(k < rest));
        let at = (self.bits(TURNS, k) as u32).wrapping_add(Self::turned(a));
        first + ((u64::from(at) * length) >> 32)
    }

    /// How far round all have gone in step `a`, in 2⁻³² of their ranges.
    pub fn turned(a: u64) -> u32 {
        (a as u32).wrapping_mul(GOLDEN)
    }

    /// What the numbers that say where they begin have in common, see [`Self::stream`].
    pub fn beginnings(&self) -> u64 {
        self.stream(TURNS)
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

    #[test]
    fn those_who_take_turns_share_all_numbers_and_come_back_late() {
        let r = Random::new(5);
        // 37 do not divide 10,000: they have 270 or 271 numbers each. At random a share of 1 − 1/e = 0.63 would have had its turn.
        let (n, of, steps) = (10_000_u64, 37, 270);
        let mut turns = vec![0; n as usize];
        let mut whose = vec![None; n as usize];
        for k in 0..of {
            for step in 0..steps {
                let number = r.turn(n, step, k, of) as usize;
                assert_eq!(*whose[number].get_or_insert(k), k, "each has numbers of its own");
                turns[number] += 1;
            }
        }
        let had = turns.iter().filter(|t| **t > 0).count();
        assert!(had > 8500 && turns.iter().all(|t| *t <= 2), "{had}");
        let many: Vec<u64> = (0..21).map(|k| r.turn(3, 9, k, 21)).collect();
        assert!((0..3).all(|number| many.iter().filter(|n| **n == number).count() == 7), "{many:?}");
    }
}
