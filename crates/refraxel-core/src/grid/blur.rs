//! The one-dimensional Gaussian that grids are blurred with, axis by axis.
//!
//! A three-dimensional Gaussian is the product of three one-dimensional ones, so a grid is blurred along x, then y, then
//! z. [`GaussianKernel::along_rows`] does the first axis, whose values are neighbours in memory, and
//! [`GaussianKernel::across_rows`] any other one. Nothing here starts a thread: a caller that has some shares out slabs,
//! or single rows by [`GaussianKernel::blur_row`].

use crate::Real;

/// What the blur takes for the nodes beyond the ends of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// The outermost node repeats. The blur stays symmetric in its weights and keeps constants.
    Continued,
    /// Nothing: the weights of the nodes that exist are divided by their sum, which keeps constants, too. Not symmetric
    /// at the border, where that sum differs between neighbours.
    Normalised,
}

/// The weights g_k ∝ exp(−k²/2σ²), |k| ≤ reach, of a Gaussian blur along one axis.
///
/// The blur of a line x is y_i = Σ_k g_k x_{i+k} with the [`Border`] rule at its ends. It is linear in x.
#[derive(Clone, Debug, PartialEq)]
pub struct GaussianKernel<T> {
    /// The terms of the sum in the order in which they are added, which fixes the rounding.
    taps: Vec<Tap<T>>,
    /// Largest |k| [node].
    reach: usize,
    border: Border,
}

/// One term of a blur: the offset k [node] and its weight g_k.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tap<T> {
    offset: isize,
    weight: T,
}

impl<T: Real> GaussianKernel<T> {
    /// The Gaussian of standard deviation `sigma` > 0 [node], cut off beyond `reach` nodes on either side.
    ///
    /// [`Border::Continued`] adds from the centre outwards with weights that sum to 1. [`Border::Normalised`] adds from
    /// the first node to the last; its weights are normalised where they are used.
    pub fn new(sigma: T, reach: usize, border: Border) -> Self {
        let mut half: Vec<T> =
            (0..=reach).map(|k| (T::of(-0.5) * (T::of(k as f64) / sigma).powi(2)).exp()).collect();
        if border == Border::Continued {
            let sum = half[0] + T::of(2.0) * half[1..].iter().copied().sum::<T>();
            half.iter_mut().for_each(|g| *g /= sum);
        }
        let reach_offset = reach as isize;
        let offsets: Vec<isize> = match border {
            Border::Continued => std::iter::once(0).chain((1..=reach_offset).flat_map(|k| [-k, k])).collect(),
            Border::Normalised => (-reach_offset..=reach_offset).collect(),
        };
        let tap = |offset: isize| Tap { offset, weight: half[offset.unsigned_abs()] };
        Self { taps: offsets.into_iter().map(tap).collect(), reach, border }
    }

    /// The same weights in another precision.
    pub fn cast<U: Real>(&self) -> GaussianKernel<U> {
        let tap = |t: &Tap<T>| Tap { offset: t.offset, weight: U::of(t.weight.f64()) };
        GaussianKernel { taps: self.taps.iter().map(tap).collect(), reach: self.reach, border: self.border }
    }

    /// The node at `offset` from node `i` of a line of `n`, by the border rule; `None` if nothing counts there.
    fn node(&self, i: usize, offset: isize, n: usize) -> Option<usize> {
        let j = i.checked_add_signed(offset).filter(|&j| j < n);
        match self.border {
            Border::Continued => j.or(Some(if offset < 0 { 0 } else { n - 1 })),
            Border::Normalised => j,
        }
    }

    /// Sum of the weights that count at node `i` of a line of `n`: 1 for [`Border::Continued`].
    fn weight_inside(&self, i: usize, n: usize) -> T {
        match self.border {
            Border::Continued => T::one(),
            Border::Normalised => {
                self.taps.iter().filter(|t| self.node(i, t.offset, n).is_some()).map(|t| t.weight).sum()
            }
        }
    }

    /// Row `i` of `n` rows of equal length, blurred across the rows: out = Σ_j g_{j−i} row(j).
    ///
    /// `row(j)` returns row j of the values before the blur; it must be as long as `out`, which is overwritten.
    pub fn blur_row<'a>(&self, i: usize, n: usize, row: impl Fn(usize) -> &'a [T], out: &mut [T]) {
        out.fill(T::zero());
        let total = self.weight_inside(i, n);
        for tap in &self.taps {
            if let Some(j) = self.node(i, tap.offset, n) {
                accumulate(out, row(j), tap.weight / total);
            }
        }
    }

    /// Blurs a slab across its rows of `width` values each: along y of a plane (x, y) whose rows are lines of x, or along
    /// z of a grid whose rows are planes (x, y).
    ///
    /// # Panics
    /// If `width` is 0.
    pub fn across_rows(&self, slab: &mut [T], width: usize) {
        let (old, n) = (slab.to_vec(), slab.len() / width);
        for (i, out) in slab.chunks_exact_mut(width).enumerate() {
            self.blur_row(i, n, |j| &old[j * width..][..width], out);
        }
    }

    /// Blurs a slab along its rows of `n` values each: along x, which runs fastest.
    ///
    /// With [`Border::Normalised`] the sum is divided instead of its weights, which differs from
    /// [`Self::across_rows`] by rounding only.
    ///
    /// # Panics
    /// If `n` is 0.
    pub fn along_rows(&self, slab: &mut [T], n: usize) {
        let scale: Vec<T> = (0..n).map(|i| self.weight_inside(i, n).recip()).collect();
        let mut padded = vec![T::zero(); n + 2 * self.reach];
        for row in slab.chunks_exact_mut(n) {
            padded[self.reach..][..n].copy_from_slice(row);
            if self.border == Border::Continued {
                padded[..self.reach].fill(row[0]);
                padded[self.reach + n..].fill(row[n - 1]);
            }
            row.fill(T::zero());
            for tap in &self.taps {
                accumulate(row, &padded[self.reach.wrapping_add_signed(tap.offset)..][..n], tap.weight);
            }
            row.iter_mut().zip(&scale).for_each(|(v, s)| *v *= *s);
        }
    }
}

/// out += weight · row, value by value.
fn accumulate<T: Real>(out: &mut [T], row: &[T], weight: T) {
    out.iter_mut().zip(row).for_each(|(o, v)| *o += weight * *v);
}

#[cfg(test)]
mod tests {
    use super::*;

    const BORDERS: [Border; 2] = [Border::Continued, Border::Normalised];

    /// y_i = Σ_k g_k x_{i+k} / Σ_k g_k, written out for one line.
    fn written_out(x: &[f64], sigma: f64, reach: i32, border: Border) -> Vec<f64> {
        let n = x.len() as i32;
        let blurred = |i: i32| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for k in -reach..=reach {
                let j = if border == Border::Continued { (i + k).clamp(0, n - 1) } else { i + k };
                if (0..n).contains(&j) {
                    let g = (-0.5 * (f64::from(k) / sigma).powi(2)).exp();
                    sum += g * x[j as usize];
                    weights += g;
                }
            }
            sum / weights
        };
        (0..n).map(blurred).collect()
    }

    #[test]
    fn both_borders_are_their_formula_along_and_across_rows() {
        let line: Vec<f64> = (0..9).map(|i| (1.7 * f64::from(i)).sin() + 0.1 * f64::from(i)).collect();
        for border in BORDERS {
            // A kernel that ends within the line, and one that reaches beyond both of its ends.
            for (sigma, reach) in [(0.8, 2), (6.0, 15)] {
                let kernel = GaussianKernel::new(sigma, reach, border);
                let expected = written_out(&line, sigma, reach as i32, border);
                let mut along = [line.clone(), line.clone()].concat();
                kernel.along_rows(&mut along, 9);
                let mut across: Vec<f64> = line.iter().flat_map(|&v| [v, -2.0 * v]).collect();
                kernel.across_rows(&mut across, 2);
                for i in 0..9 {
                    let found = [along[i], along[9 + i], across[2 * i], -0.5 * across[2 * i + 1]];
                    assert!(
                        found.iter().all(|v| (v - expected[i]).abs() < 1e-14),
                        "{border:?} {i}: {found:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_constant_stays_itself_up_to_the_border() {
        for border in BORDERS {
            let mut slab = vec![0.7; 5 * 7];
            let kernel = GaussianKernel::new(1.6_f64, 4, border);
            kernel.along_rows(&mut slab, 5);
            kernel.across_rows(&mut slab, 5);
            assert!(slab.iter().all(|v| (v - 0.7).abs() < 1e-15), "{border:?}");
        }
    }

    #[test]
    fn the_blur_with_a_continued_border_is_symmetric_where_the_border_is_constant() {
        // ⟨u, G v⟩ = ⟨G u, v⟩ for lines that are 0 within the reach of their ends.
        let kernel = GaussianKernel::new(1.0_f64, 3, Border::Continued);
        let line = |f: fn(f64) -> f64| -> Vec<f64> {
            (0..14).map(|i| if (4..10).contains(&i) { f(f64::from(i)) } else { 0.0 }).collect()
        };
        let blurred = |v: &[f64]| {
            let mut v = v.to_vec();
            kernel.along_rows(&mut v, 14);
            v
        };
        let inner = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let (u, v) = (line(f64::sin), line(|i| (i * i).cos()));
        assert!((inner(&u, &blurred(&v)) - inner(&blurred(&u), &v)).abs() < 1e-15);
    }
}
