//! Least squares by normal equations.

/// The solution of (A + damping · (diag A + mean)) x = b by Cholesky's decomposition; `None` where that is
/// not positive.
pub(crate) fn solved(matrix: &[f64], right: &[f64], damping: f64) -> Option<Vec<f64>> {
    let n = right.len();
    let mean = (0..n).map(|i| matrix[i * n + i]).sum::<f64>() / n.max(1) as f64;
    let mut l = matrix.to_vec();
    for i in 0..n {
        l[i * n + i] += damping * (l[i * n + i] + 0.01 * mean);
        for j in 0..=i {
            let (row, other) = (&l[i * n..i * n + j], &l[j * n..j * n + j]);
            let sum = l[i * n + j] - row.iter().zip(other).map(|(a, b)| a * b).sum::<f64>();
            if i == j && sum <= 0.0 {
                return None;
            }
            l[i * n + j] = if i == j { sum.sqrt() } else { sum / l[j * n + j] };
        }
    }
    let mut x = right.to_vec();
    for i in 0..n {
        x[i] = (x[i] - (0..i).map(|j| l[i * n + j] * x[j]).sum::<f64>()) / l[i * n + i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|j| l[j * n + i] * x[j]).sum::<f64>()) / l[i * n + i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
}

/// Weight of a squared residual, ¼ at `scale`: ψ'(s) of ψ(s) = s/(1 + s/scale) (Geman & McClure 1985).
pub(crate) fn outlier_weight(squared: f64, scale: f64) -> f64 {
    (1.0 + squared / scale).powi(-2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_of_equations_is_solved() {
        let matrix = [4.0, 2.0, 0.5, 2.0, 5.0, 1.0, 0.5, 1.0, 3.0];
        let x = solved(&matrix, &[1.0, -2.0, 0.5], 0.0).unwrap();
        for (i, b) in [1.0, -2.0, 0.5].into_iter().enumerate() {
            let sum: f64 = (0..3).map(|j| matrix[3 * i + j] * x[j]).sum();
            assert!((sum - b).abs() < 1e-12);
        }
        assert!(solved(&[1.0, 2.0, 2.0, 1.0], &[0.0, 0.0], 0.0).is_none());
    }
}
