//! Which cells of an index grid are flat, and how far each cell is from the nearest one that is not.
//!
//! A cell depends on the 4³ nodes around it. Rays need no force where these have one value, and hop over such cells; the
//! distances say how far they may hop without testing the cells between.

use crate::Real;

/// Largest difference of w [1] between the coefficients of a cell that counts as flat. To cross a voxel without its kicks
/// then changes the direction of a ray by at most this angle [rad]. Covers the rounding of `f32` coefficients.
pub const FLAT: f64 = 1e-6;

/// Distances of more cells are stored as this one, which bounds the length of a hop.
pub(super) const FAR: u8 = 16;

/// For each cell of the grid (n − 1 per axis, x fastest) the Chebyshev distance [cell] to the nearest cell that must be
/// marched: 0 where the 4³ coefficients `c` differ by more than [`FLAT`], or where one of them is `free` (one flag per
/// node).
pub(super) fn clearance<T: Real>(c: &[T], n: [usize; 3], free: Option<&[bool]>) -> Vec<u8> {
    let low = windows(c, n, T::min);
    let high = windows(c, n, T::max);
    let tolerance = T::of(FLAT);
    let mut distance: Vec<u8> =
        low.iter().zip(&high).map(|(&a, &b)| if b - a <= tolerance { FAR } else { 0 }).collect();
    if let Some(free) = free {
        let touched = windows(free, n, |a, b| a | b);
        distance.iter_mut().zip(touched).filter(|(_, t)| *t).for_each(|(d, _)| *d = 0);
    }
    transform(&mut distance, n);
    distance
}

/// For each cell of a grid of `n` nodes the Chebyshev distance [cell] to the nearest one that is `marked` (one flag per
/// cell, n − 1 per axis, x fastest); 16 for all that are farther.
pub fn distance_to(marked: &[bool], n: [usize; 3]) -> Vec<u8> {
    let mut distance: Vec<u8> = marked.iter().map(|m| if *m { 0 } else { FAR }).collect();
    transform(&mut distance, n);
    distance
}

/// Replaces 0 in marked cells and [`FAR`] elsewhere by the distances: how often the marked cells must grow by one cell on all
/// sides to reach a cell.
fn transform(distance: &mut [u8], n: [usize; 3]) {
    let cells = n.map(|v| v - 1);
    let mut reached: Vec<u8> = distance.iter().map(|d| u8::from(*d == 0)).collect();
    let mut before = vec![0; reached.len()];
    distance.fill(0);
    for _ in 0..FAR {
        distance.iter_mut().zip(&reached).for_each(|(d, r)| *d += 1 - r);
        for axis in 0..3 {
            before.copy_from_slice(&reached);
            let (stride, line) = (cells[..axis].iter().product(), cells[..=axis].iter().product());
            for (out, of) in reached.chunks_exact_mut(line).zip(before.chunks_exact(line)) {
                let (first, last) = (line - stride, stride);
                out[..first].iter_mut().zip(&of[last..]).for_each(|(r, next)| *r |= next);
                out[last..].iter_mut().zip(&of[..first]).for_each(|(r, next)| *r |= next);
            }
        }
    }
}

/// [`clearance`] of a grid of vacuum with `n` nodes per axis: [`FAR`] in each cell.
pub(super) fn everywhere(n: [usize; 3]) -> Vec<u8> {
    vec![FAR; n.iter().map(|n| n - 1).product()]
}

/// For each cell i the `best` (minimum, maximum, or) of the nodes i − 1 … i + 2 that exist, along all three axes in turn.
/// `v` has one value per node, the result one per cell, x fastest.
pub(super) fn windows<V: Copy>(v: &[V], mut n: [usize; 3], best: impl Fn(V, V) -> V) -> Vec<V> {
    let mut v = v.to_vec();
    for axis in 0..3 {
        let inner: usize = n[..axis].iter().product();
        let (len, old) = (n[axis], v);
        v = Vec::with_capacity(old.len());
        for line in old.chunks_exact(inner * len) {
            if axis == 0 {
                v.push(best(best(line[0], line[1]), line[2.min(len - 1)]));
                v.extend(line.windows(4).map(|w| best(best(w[0], w[1]), best(w[2], w[3]))));
                v.extend((len > 2).then(|| best(best(line[len - 3], line[len - 2]), line[len - 1])));
                continue;
            }
            for cell in 0..len - 1 {
                let [a, b, c, d] = [cell.saturating_sub(1), cell, cell + 1, (cell + 2).min(len - 1)]
                    .map(|node| &line[node * inner..][..inner]);
                let pairs = a.iter().zip(b).zip(c.iter().zip(d));
                v.extend(pairs.map(|((a, b), (c, d))| best(best(*a, *b), best(*c, *d))));
            }
        }
        n[axis] = len - 1;
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clearance_is_the_chebyshev_distance_to_the_nearest_marched_cell() {
        let n = [9, 7, 8];
        let mut free = vec![false; 9 * 7 * 8];
        let marked = [[1, 1, 2], [6, 5, 5]];
        for m in marked {
            free[m[0] + 9 * (m[1] + 7 * m[2])] = true;
        }
        let found = clearance(&vec![0.5_f32; free.len()], n, Some(&free));
        // Node m is in the stencils of cells m − 2 … m + 1.
        let outside = |c: usize, m: usize| (m as i32 - 2 - c as i32).max(c as i32 - m as i32 - 1).max(0);
        for (i, &d) in found.iter().enumerate() {
            let cell = [i % 8, i / 8 % 6, i / 48];
            let to = |m: [usize; 3]| (0..3).map(|a| outside(cell[a], m[a])).max().unwrap();
            assert_eq!(i32::from(d), marked.map(to).into_iter().min().unwrap(), "cell {cell:?}");
        }
    }
}
