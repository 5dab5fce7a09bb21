//! From samples to B-spline coefficients, theory (2.8).
//!
//! A cubic B-spline takes the value (c₋ + 4 c + c₊)/6 at a node, so coefficients that reproduce given samples solve a
//! tridiagonal system along each line. Elimination without pivoting is stable: the matrix is diagonally dominant.

use crate::Real;

/// Solves (c₋ + 4 c + c₊)/6 = s, theory (2.8), along each axis in turn, in place, for an array of `n` nodes (x fastest)
/// that is 0 beyond its ends: the coefficients whose cubic B-spline takes the values `s` at the nodes.
///
/// Error: the spline is O(h⁴) off where the sampled function is smooth. Symmetric, hence its own transpose. Source: Unser 1999, by elimination instead of recursive filters.
pub(super) fn interpolate<T: Real>(s: &mut [T], n: [usize; 3]) {
    let strides = [1, n[0], n[0] * n[1]];
    for axis in 0..3 {
        let pivots = pivots(n[axis]);
        for start in line_starts(n, axis) {
            solve_line(s, start, strides[axis], &pivots);
        }
    }
}

/// [`interpolate`] for all `n` ≥ 3 nodes of a grid, where nothing is 0 beyond the ends: the second derivative of the spline
/// is 0 at the first and last node of a line, whose coefficient then is the sample. Linear functions are their own
/// coefficients.
pub(super) fn interpolate_all<T: Real>(s: &mut [T], n: [usize; 3]) {
    let strides = [1, n[0], n[0] * n[1]];
    let sixth = T::of(1.0 / 6.0);
    for axis in 0..3 {
        let (stride, last) = (strides[axis], n[axis] - 1);
        let pivots = pivots(n[axis] - 2);
        for start in line_starts(n, axis) {
            let ends = [s[start], s[start + last * stride]];
            s[start + stride] -= sixth * ends[0];
            s[start + (last - 1) * stride] -= sixth * ends[1];
            solve_line(s, start + stride, stride, &pivots);
        }
    }
}

/// Indices of the first nodes of the lines along an axis.
fn line_starts(n: [usize; 3], axis: usize) -> impl Iterator<Item = usize> {
    let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
    let strides = [1, n[0], n[0] * n[1]];
    (0..n[b]).flat_map(move |j| (0..n[a]).map(move |i| i * strides[a] + j * strides[b]))
}

/// Reciprocal pivots of the elimination of the matrix (1, 4, 1): r₀ = 1/4, r = 1/(4 − r₋).
fn pivots<T: Real>(n: usize) -> Vec<T> {
    let mut r = T::zero();
    (0..n)
        .map(|_| {
            r = (T::of(4.0) - r).recip();
            r
        })
        .collect()
}

/// Solves the system of one line in place: forward elimination, then substitution from the end. The line has one node per
/// pivot, `stride` apart, from `start` on.
fn solve_line<T: Real>(s: &mut [T], start: usize, stride: usize, pivots: &[T]) {
    let six = T::of(6.0);
    // forward: c₋ + 4 c + c₊ = 6 s, with c₋ eliminated
    let mut before = T::zero();
    for (i, &r) in pivots.iter().enumerate() {
        let v = &mut s[start + i * stride];
        before = (six * *v - before) * r;
        *v = before;
    }
    let mut after = T::zero();
    for (i, &r) in pivots.iter().enumerate().rev() {
        let v = &mut s[start + i * stride];
        after = *v - r * after;
        *v = after;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::tests::Sequence;

    #[test]
    fn prefiltering_is_its_own_transpose() {
        let (n, mut r) = ([3, 5, 4], Sequence(2));
        let [a, b]: [Vec<f64>; 2] = std::array::from_fn(|_| (0..60).map(|_| r.next()).collect());
        let filtered = |v: &[f64]| {
            let mut v = v.to_vec();
            interpolate(&mut v, n);
            v
        };
        let inner = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        assert!((inner(&a, &filtered(&b)) - inner(&filtered(&a), &b)).abs() < 1e-11);
    }
}
