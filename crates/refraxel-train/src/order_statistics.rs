//! Order statistics of a few numbers.

/// The largest and the median of some numbers; zero where there are none.
pub(crate) fn largest_and_median(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let mut all: Vec<f64> = numbers.collect();
    all.sort_by(f64::total_cmp);
    [all.last(), all.get(all.len() / 2)].map(|n| n.copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_and_the_median_of_numbers() {
        assert_eq!(largest_and_median([3.0, 1.0, 2.0].into_iter()), [3.0, 2.0]);
        assert_eq!(largest_and_median(std::iter::empty()), [0.0, 0.0]);
    }
}
