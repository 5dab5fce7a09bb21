//! Gaussian blur of a scalar on the nodes of a grid, on all threads.

use rayon::prelude::*;
use refraxel_core::grid::{Border, GaussianKernel};

/// Where the kernel is cut off, in its standard deviation: 1.2 % of the weight lies beyond.
const REACH: f32 = 2.5;

/// Blurs `values` (one per node, x fastest) in place with a Gaussian of standard deviation `sigma` [voxel], axis by axis:
/// y_i = Σ_k g_k x_{i+k} / Σ_k g_k over the nodes that exist ([`Border::Normalised`]), so that a constant stays itself up
/// to the border.
///
/// The kernel ends at ±2.5 `sigma`. Nothing happens for `sigma` ≤ 0. Linear; not symmetric at the border, where the
/// normalisation differs between neighbours. The bits of the result do not depend on the number of threads.
///
/// # Panics
/// If there is not one value per node.
pub fn gaussian_blur(values: &mut [f32], resolution: [u32; 3], sigma: f32) {
    let [nx, ny, nz] = resolution.map(|n| n as usize);
    assert_eq!(values.len(), nx * ny * nz, "one value per node of {resolution:?}");
    if sigma > 0.0 && !values.is_empty() {
        let kernel = GaussianKernel::new(sigma, (REACH * sigma).ceil() as usize, Border::Normalised);
        values.par_chunks_exact_mut(nx * ny).for_each(|plane| {
            kernel.along_rows(plane, nx);
            kernel.across_rows(plane, nx);
        });
        // Along z the rows of x are shared out: there may be fewer planes than threads.
        let old = values.to_vec();
        values.par_chunks_exact_mut(nx).enumerate().for_each(|(line, row)| {
            let (y, z) = (line % ny, line / ny);
            kernel.blur_row(z, nz, |k| &old[(k * ny + y) * nx..][..nx], row);
        });
    }
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
