//! What keeps a surface smooth, theory (2.31) and (2.32).

use super::LevelSet;
use crate::Real;

/// Nodes whose |φ| [voxel] is at most this count in the bending energy: further away a distance has creases that say nothing
/// about the surface.
pub const BAND: f64 = 2.0;

/// Bending energy of a level set near its surface, theory (2.31): half the sum of the squared second derivatives of φ
/// [1 / voxel], by differences of the coefficients, per node of the band. For a distance the sum is that of the squared
/// principal curvatures: a sphere of radius R [voxel] has 1/R².
///
/// The band is held fixed in derivatives.
pub fn bending<T: Real>(level: &LevelSet<T>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    each_difference(level, |of_node| {
        count += 1;
        sum += of_node.iter().map(|d| 0.5 * (d.weight * d.value * d.value).f64()).sum::<f64>();
    });
    sum / count.max(1) as f64
}

/// Adds `weight` times the gradient of [`bending`] to `grad`. The border receives nothing.
pub fn bending_vjp<T: Real>(level: &LevelSet<T>, weight: T, grad: &mut [T]) {
    let mut count = 0usize;
    each_difference(level, |_| count += 1);
    let scale = weight / T::of(count.max(1) as f64);
    each_difference(level, |of_node| {
        for d in of_node {
            for (node, factor) in d.terms {
                if level.is_parameter(node) {
                    grad[node] += scale * d.weight * d.value * factor;
                }
            }
        }
    });
}

/// Σ factor · c over four nodes (one of them twice), and how often it counts.
struct Difference<T> {
    value: T,
    weight: T,
    terms: [(usize, T); 4],
}

/// The six second differences of φ [1 / voxel] at each parameter of the band.
fn each_difference<T: Real>(level: &LevelSet<T>, mut f: impl FnMut(&[Difference<T>; 6])) {
    let (c, voxel, lattice) = (level.coefficients(), level.voxel(), level.lattice());
    let n = lattice.nodes();
    let strides = [1, n[0], n[0] * n[1]];
    let (one, quarter, scale) = (T::one(), T::of(0.25), lattice.scale);
    for node in level.parameters().filter(|&j| c[j].abs() <= T::of(BAND) * voxel) {
        let difference = |weight: T, terms: [(usize, T); 4]| Difference {
            value: terms.iter().map(|&(j, factor)| factor * c[j]).sum(),
            weight,
            terms,
        };
        f(&[(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)].map(|(a, b)| {
            let unit = voxel * scale[a] * scale[b];
            let (i, j) = (strides[a], strides[b]);
            if a == b {
                let ends = [(node - i, unit), (node + i, unit)];
                return difference(one, [ends[0], ends[1], (node, -unit), (node, -unit)]);
            }
            let (plus, minus) = (unit * quarter, -unit * quarter);
            let [low, high] = [node - i, node + i];
            let terms = [(high + j, plus), (low - j, plus), (high - j, minus), (low + j, minus)];
            difference(one + one, terms)
        }));
    }
}

impl<T: Real> LevelSet<T> {
    /// One step of smoothing, theory (2.32): φ ← φ − α (I − G)² φ with G a Gaussian of a standard deviation of one voxel.
    /// Steps of a staircase fade, and a ball keeps its size to second order: α = 0.1 sixty times turns a visual hull of
    /// voxels into a smooth surface. Stable for α in [0, 1]. The border stays.
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

/// Convolution with a Gaussian of one voxel, cut at 4; the outermost nodes are continued.
fn blur<T: Real>(c: &[T], n: [usize; 3]) -> Vec<T> {
    const REACH: usize = 4;
    let mut kernel: Vec<f64> = (0..=REACH).map(|i| (-0.5 * (i * i) as f64).exp()).collect();
    let sum = kernel[0] + 2.0 * kernel[1..].iter().sum::<f64>();
    kernel.iter_mut().for_each(|k| *k /= sum);
    let mut c = c.to_vec();
    for axis in 0..3 {
        let inner: usize = n[..axis].iter().product();
        let old = c.clone();
        for (line, out) in old.chunks_exact(inner * n[axis]).zip(c.chunks_exact_mut(inner * n[axis])) {
            for i in 0..n[axis] {
                let out = &mut out[i * inner..][..inner];
                out.fill(T::zero());
                for (k, &weight) in kernel.iter().enumerate() {
                    let ends = [i.saturating_sub(k), (i + k).min(n[axis] - 1)];
                    for end in &ends[..if k == 0 { 1 } else { 2 }] {
                        let from = &line[end * inner..][..inner];
                        out.iter_mut().zip(from).for_each(|(o, f)| *o += T::of(weight) * *f);
                    }
                }
            }
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::index::tests::Sequence;
    use crate::{Aabb, Vec3};

    fn ball(radius: f64, nodes: u32) -> LevelSet<f64> {
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        LevelSet::from_samples(cube, [nodes; 3], |x| x.length() - radius)
    }

    #[test]
    fn the_bending_energy_of_a_sphere_is_its_squared_curvature() {
        for (radius, nodes) in [(0.5, 41), (0.6, 61)] {
            let in_voxels = radius * f64::from(nodes - 1) / 2.0;
            let found = bending(&ball(radius, nodes)) * in_voxels * in_voxels;
            assert!((found - 1.0).abs() < 0.05, "{found}");
        }
    }

    #[test]
    fn the_gradient_of_the_bending_energy_matches_central_differences() {
        let bounds = Aabb::new(Vec3::splat(-1.0), Vec3 { x: 1.0, y: 1.2, z: 0.9 });
        let mut r = Sequence(3);
        let c: Vec<f64> = (0..11 * 12 * 13).map(|_| 0.3 * r.next()).collect();
        let mut level = LevelSet::from_coefficients(bounds, [11, 12, 13], c).unwrap();
        let mut grad = vec![0.0; level.coefficients().len()];
        bending_vjp(&level, 0.7, &mut grad);
        let size = grad.iter().fold(0.0_f64, |m, g| m.max(g.abs()));
        for node in level.parameters().step_by(5).collect::<Vec<_>>() {
            let mut energy = |e: f64| {
                level.coefficients_mut()[node] += e;
                let sum = 0.7 * bending(&level);
                level.coefficients_mut()[node] -= e;
                sum
            };
            let fd = (energy(1e-6) - energy(-1e-6)) / 2e-6;
            assert!((fd - grad[node]).abs() < 1e-7 * size, "{fd} vs {}", grad[node]);
        }
        assert!((0..grad.len()).all(|j| level.is_parameter(j) || grad[j] == 0.0));
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
        let (radius, cube) = (0.6, Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0)));
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
