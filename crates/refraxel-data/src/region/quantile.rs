//! Order statistics.

use refraxel_core::Real;

/// The q-quantile of some numbers by nearest rank: the smallest for q = 0, the median for 0.5 (of an even count the larger of
/// the two in the middle), the largest for 1; `None` for none. Numbers are ordered by [`f64::total_cmp`].
pub fn quantile<T: Real>(values: impl IntoIterator<Item = T>, q: f64) -> Option<T> {
    let mut sorted: Vec<T> = values.into_iter().collect();
    sorted.sort_by(|a, b| a.f64().total_cmp(&b.f64()));
    let last = sorted.len().checked_sub(1)?;
    sorted.get((q * last as f64).round() as usize).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_order_statistics() {
        let values = [5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!([0.0, 0.5, 1.0].map(|q| quantile(values, q)), [Some(1.0), Some(3.0), Some(5.0)]);
        assert_eq!(quantile([4.0_f32, 1.0, 3.0, 2.0], 0.5), Some(3.0));
        assert_eq!(quantile::<f64>([], 0.5), None);
    }
}
