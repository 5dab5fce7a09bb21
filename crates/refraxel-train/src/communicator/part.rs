//! Who does what of things in a row.

use std::ops::Range;

/// Of `n` things in a row, those of a process: as many as of any other, give or take one.
pub fn part(n: usize, rank: usize, count: usize) -> Range<usize> {
    n * rank / count..n * (rank + 1) / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_and_are_as_large_as_each_other() {
        for (n, count) in [(0, 3), (7, 2), (64, 5), (3, 4)] {
            let parts: Vec<_> = (0..count).map(|rank| part(n, rank, count)).collect();
            assert!(parts.iter().flat_map(Clone::clone).eq(0..n));
            let sizes: Vec<usize> = parts.iter().map(ExactSizeIterator::len).collect();
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1, "{sizes:?}");
        }
    }
}
