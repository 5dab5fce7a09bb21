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
    for axis in 0..3 {
        let pivots = pivots(n[axis]);
        for lines in side_by_side(s, n, axis) {
            solve(lines, &pivots);
        }
    }
}

/// [`interpolate`] for all `n` ≥ 3 nodes of a grid, where nothing is 0 beyond the ends: the second derivative of the spline
/// is 0 at the first and last node of a line, whose coefficient then is the sample. Linear functions are their own
/// coefficients.
pub(super) fn interpolate_all<T: Real>(s: &mut [T], n: [usize; 3]) {
    let sixth = T::of(1.0 / 6.0);
    for axis in 0..3 {
        let pivots = pivots(n[axis] - 2);
        for lines in side_by_side(s, n, axis) {
            let width = lines.len() / n[axis];
            let (first, rest) = lines.split_at_mut(width);
            let (inner, last) = rest.split_at_mut(rest.len() - width);
            let less = |row: &mut [T], end: &[T]| {
                row.iter_mut().zip(end).for_each(|(v, end)| *v -= sixth * *end);
            };
            less(&mut inner[..width], first);
            let beside_last = inner.len() - width;
            less(&mut inner[beside_last..], last);
            solve(inner, &pivots);
        }
    }
}

/// The lines along an axis, in groups of those whose nodes are neighbours in memory: a group holds the first nodes of its
/// lines, then the second ones, …
fn side_by_side<T>(s: &mut [T], n: [usize; 3], axis: usize) -> impl Iterator<Item = &mut [T]> {
    let width: usize = n[..axis].iter().product();
    s.chunks_exact_mut(width * n[axis])
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

/// Solves the systems of lines that are side by side, in place: forward elimination, then substitution from the end. A line
/// has one node per pivot.
fn solve<T: Real>(lines: &mut [T], pivots: &[T]) {
    let (width, six) = (lines.len() / pivots.len().max(1), T::of(6.0));
    // forward: c₋ + 4 c + c₊ = 6 s, with c₋ eliminated
    for (i, &r) in pivots.iter().enumerate() {
        let (done, rest) = lines.split_at_mut(i * width);
        let row = &mut rest[..width];
        match i {
            0 => row.iter_mut().for_each(|v| *v = six * *v * r),
            _ => {
                let before = &done[(i - 1) * width..];
                row.iter_mut().zip(before).for_each(|(v, b)| *v = (six * *v - *b) * r);
            }
        }
    }
    for (i, &r) in pivots.iter().enumerate().rev().skip(1) {
        let (row, rest) = lines[i * width..].split_at_mut(width);
        row.iter_mut().zip(&rest[..width]).for_each(|(v, after)| *v -= r * *after);
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
