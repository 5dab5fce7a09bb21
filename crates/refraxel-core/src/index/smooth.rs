//! Smoothing of a surface, theory (2.31).
//!
//! Gradients of single rays are rough, and visual hulls of voxels have steps. A blur would remove both, but also shrink the
//! body; the square of the high-pass I − G leaves alone what varies little over a voxel.

use super::LevelSet;
use crate::Real;
use crate::grid::{Border, GaussianKernel};

/// Standard deviation of the Gaussian G [voxel]: steps of this width fade.
const SIGMA: f64 = 1.0;
/// Cut-off of G [voxel]: 3e-6 of its weight lies beyond.
const REACH: usize = 4;

impl<T: Real> LevelSet<T> {
    /// One step of smoothing, theory (2.31): φ ← φ − α (I − G)² φ with G a Gaussian of one voxel.
    /// The border stays.
    ///
    /// `alpha` [1] is stable in [0, 1]. Steps of a staircase fade, and a ball keeps its size to second order: sixty steps
    /// with α = 0.1 turn a visual hull of voxels into a smooth surface and move the surface of a ball of 14 voxels by less
    /// than 0.01 voxel (root mean square).
    pub fn smooth(&mut self, alpha: T) {
        let n = self.lattice().nodes();
        let mut rough = self.coefficients().to_vec();
        for _ in 0..2 {
            let blurred = blur(&rough, n);
            rough.iter_mut().zip(blurred).for_each(|(r, b)| *r -= b);
        }
        for j in self.parameters().collect::<Vec<_>>() {
            self.coefficients_mut()[j] -= alpha * rough[j];
        }
        self.find_surface();
    }
}

/// A grid of `n` nodes per axis, x fastest, blurred with G; the outermost nodes are continued.
fn blur<T: Real>(c: &[T], n: [usize; 3]) -> Vec<T> {
    let kernel = GaussianKernel::new(SIGMA, REACH, Border::Continued).cast::<T>();
    let mut c = c.to_vec();
    kernel.along_rows(&mut c, n[0]);
    c.chunks_exact_mut(n[0] * n[1]).for_each(|plane| kernel.across_rows(plane, n[0]));
    kernel.across_rows(&mut c, n[0] * n[1]);
    c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::tests::Sequence;
    use crate::{Aabb, Vec3};

    fn ball(radius: f64, nodes: u32) -> LevelSet<f64> {
        let cube = Aabb::cube(1.0);
        LevelSet::from_samples(cube, [nodes; 3], |x| x.length() - radius)
    }

    /// Root mean square of φ on the sphere, in voxels.
    fn roughness(level: &LevelSet<f64>, radius: f64) -> f64 {
        let mut r = Sequence(5);
        let square = (0..500).map(|_| level.value(r.vector().normalized() * radius).powi(2)).sum::<f64>();
        (square / 500.0).sqrt() / level.voxel()
    }

    #[test]
    fn smoothing_removes_steps_and_keeps_the_ball() {
        // Constant in blocks of two voxels.
        let (radius, cube) = (0.6, Aabb::cube(1.0));
        let step = 4.0 / 47.0;
        let steps = |x: Vec3<f64>| x.map(|x| ((x / step).floor() + 0.5) * step).length() - radius;
        let mut level = LevelSet::from_control_values(cube, [48; 3], steps);
        let before = roughness(&level, radius);
        (0..60).for_each(|_| level.smooth(0.1));
        let after = roughness(&level, radius);
        assert!(after < 0.4 * before && after < 0.05, "{before} to {after} voxels");
        let mut exact = ball(radius, 48);
        (0..60).for_each(|_| exact.smooth(0.1));
        assert!(roughness(&exact, radius) < 0.01, "{}", roughness(&exact, radius));
    }
}
