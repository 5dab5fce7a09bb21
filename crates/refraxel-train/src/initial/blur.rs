//! Gaussian blur of a scalar on the nodes of a grid.

use rayon::prelude::*;

/// Where the kernel is cut off, in its standard deviation: 1.2 % of the weight lies beyond.
const REACH: f32 = 2.5;

/// Blurs `values` (one per node, x fastest) in place with a Gaussian of standard deviation `sigma` [voxel], axis by axis:
/// y_i = Σ_k g_k x_{i+k} / Σ_k g_k over the nodes that exist, so that a constant stays itself up to the border.
///
/// The kernel ends at ±2.5 `sigma`. Nothing happens for `sigma` ≤ 0. Linear; not symmetric at the border, where the
/// normalisation differs between neighbours.
///
/// # Panics
/// If there is not one value per node.
pub fn gaussian_blur(values: &mut [f32], resolution: [u32; 3], sigma: f32) {
    let n = resolution.map(|n| n as usize);
    assert_eq!(values.len(), n.iter().product::<usize>(), "one value per node of {n:?}");
    if sigma > 0.0 && !values.is_empty() {
        let kernel = half_kernel(sigma);
        values.par_chunks_exact_mut(n[0] * n[1]).for_each(|slab| {
            blur_rows(slab, n[0], &kernel);
            blur_strided(slab, n[0], &kernel);
        });
        blur_slabs(values, n, &kernel);
    }
}

/// g_0, g_1, … g_r, unnormalised.
fn half_kernel(sigma: f32) -> Vec<f32> {
    let radius = (REACH * sigma).ceil() as usize;
    (0..=radius).map(|k| (-0.5 * (k as f32 / sigma).powi(2)).exp()).collect()
}

/// The nodes `i + k` of a line of `n` within the kernel's reach, with their normalised weights.
fn taps(kernel: &[f32], n: usize, i: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
    let r = kernel.len() - 1;
    let range = i.saturating_sub(r)..(i + r + 1).min(n);
    let total: f32 = range.clone().map(|j| kernel[j.abs_diff(i)]).sum();
    range.map(move |j| (j, kernel[j.abs_diff(i)] / total))
}

/// out += weight * row, element by element.
fn accumulate(out: &mut [f32], row: &[f32], weight: f32) {
    out.iter_mut().zip(row).for_each(|(o, v)| *o += weight * v);
}

/// Along x: each row padded with zeros, divided by the weight that lay inside.
fn blur_rows(slab: &mut [f32], n: usize, kernel: &[f32]) {
    let r = kernel.len() - 1;
    let inside =
        |i: usize| (i.saturating_sub(r)..(i + r + 1).min(n)).map(|j| kernel[j.abs_diff(i)]).sum::<f32>();
    let scale: Vec<f32> = (0..n).map(|i| 1.0 / inside(i)).collect();
    let mut padded = vec![0.0; n + 2 * r];
    for row in slab.chunks_exact_mut(n) {
        padded[r..r + n].copy_from_slice(row);
        row.fill(0.0);
        (0..=2 * r).for_each(|k| accumulate(row, &padded[k..k + n], kernel[k.abs_diff(r)]));
        row.iter_mut().zip(&scale).for_each(|(v, s)| *v *= s);
    }
}

/// Along y, within one slab of constant z: whole rows of `width` at a time.
fn blur_strided(slab: &mut [f32], width: usize, kernel: &[f32]) {
    let old = slab.to_vec();
    for (y, row) in slab.chunks_exact_mut(width).enumerate() {
        row.fill(0.0);
        taps(kernel, old.len() / width, y).for_each(|(j, w)| accumulate(row, &old[j * width..][..width], w));
    }
}

/// Along z, row by row.
fn blur_slabs(values: &mut [f32], [nx, ny, nz]: [usize; 3], kernel: &[f32]) {
    let old = values.to_vec();
    values.par_chunks_exact_mut(nx).enumerate().for_each(|(line, row)| {
        let (y, z) = (line % ny, line / ny);
        row.fill(0.0);
        taps(kernel, nz, z).for_each(|(j, w)| accumulate(row, &old[(j * ny + y) * nx..][..nx], w));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: [u32; 3] = [11, 9, 13];

    #[test]
    fn a_constant_stays_itself_up_to_the_border() {
        let mut v = vec![0.7; 11 * 9 * 13];
        gaussian_blur(&mut v, N, 1.6);
        assert!(v.iter().all(|v| (v - 0.7).abs() < 1e-6));
    }

    #[test]
    fn a_point_becomes_a_gaussian() {
        let mut v = vec![0.0; 25 * 25 * 25];
        v[(12 * 25 + 12) * 25 + 12] = 1.0;
        gaussian_blur(&mut v, [25; 3], 1.5);
        let (mut sum, mut second) = (0.0, [0.0; 3]);
        for (i, v) in v.iter().enumerate() {
            sum += v;
            for (a, i) in [i % 25, i / 25 % 25, i / 625].into_iter().enumerate() {
                second[a] += v * (i as f32 - 12.0).powi(2);
            }
        }
        assert!((sum - 1.0).abs() < 1e-5);
        // The cut-off at 2.5 σ takes 6 % of the variance.
        assert!(second.iter().all(|s| (s / 2.25 - 0.96).abs() < 0.04), "{second:?}");
    }

    #[test]
    fn all_axes_are_treated_alike() {
        let at = |x: usize, y: usize, z: usize| ((x * 7 + y * 13 + z * 29) % 11) as f32;
        let fill = |p: [usize; 3]| -> Vec<f32> {
            (0..512)
                .map(|i| {
                    let c = [i % 8, i / 8 % 8, i / 64];
                    at(c[p[0]], c[p[1]], c[p[2]])
                })
                .collect()
        };
        let (mut a, mut b) = (fill([0, 1, 2]), fill([2, 0, 1]));
        gaussian_blur(&mut a, [8; 3], 1.2);
        gaussian_blur(&mut b, [8; 3], 1.2);
        for i in 0..512 {
            let c = [i % 8, i / 8 % 8, i / 64];
            assert!((b[i] - a[c[2] + 8 * (c[0] + 8 * c[1])]).abs() < 1e-5);
        }
    }

    #[test]
    fn no_width_changes_nothing() {
        let mut v: Vec<f32> = (0..27).map(|i| i as f32).collect();
        let before = v.clone();
        gaussian_blur(&mut v, [3; 3], 0.0);
        assert_eq!(v, before);
    }
}
