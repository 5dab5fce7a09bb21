/// Round values within [`low`, `high`], about `count` of them, in steps of 1, 2 or 5 times a power of ten.
///
/// Also returns the number of decimals that tells them apart.
pub fn ticks(low: f64, high: f64, count: usize) -> (Vec<f64>, usize) {
    let step = step(high - low, count);
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
    ((first..=last).map(|k| k as f64 * step).collect(), decimals)
}

/// The range widened to whole steps, and never empty.
pub fn rounded(low: f64, high: f64, count: usize) -> (f64, f64) {
    let (low, high) = if high > low { (low, high) } else { (low - 0.5, low + 0.5) };
    let step = step(high - low, count);
    ((low / step).floor() * step, (high / step).ceil() * step)
}

fn step(span: f64, count: usize) -> f64 {
    let raw = (span / count.max(1) as f64).max(f64::MIN_POSITIVE);
    let power = 10f64.powf(raw.log10().floor());
    let factor = raw / power;
    power
        * if factor < 1.5 {
            1.0
        } else if factor < 3.5 {
            2.0
        } else if factor < 7.5 {
            5.0
        } else {
            10.0
        }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(0.0, 3000.0, 6), (vec![0.0, 500.0, 1000.0, 1500.0, 2000.0, 2500.0, 3000.0], 0));
        assert_eq!(ticks(21.3, 29.9, 4), (vec![22.0, 24.0, 26.0, 28.0], 0));
        let (values, decimals) = ticks(0.0, 1.0, 5);
        assert_eq!((values.len(), decimals), (6, 1));
    }

    #[test]
    fn range_covers_its_data_and_is_never_empty() {
        assert_eq!(rounded(21.3, 29.9, 4), (20.0, 30.0));
        let (low, high) = rounded(7.0, 7.0, 4);
        assert!(low < 7.0 && high > 7.0);
    }
}
