//! Thin matter is sampled by chance.

use super::quadrature::QuadraturePoint;
use crate::segment::Segment;
use crate::{Real, VoxelField, sh};

/// What is left of the points on a path where those of an optical depth τ below `thin` are taken by chance, with the probability
/// τ/`thin`, and count with the optical depth `thin`, theory (4.6).
///
/// Points are taken one after the other whenever the sum of their probabilities, which begins with `phase` ∈ [0, 1), passes a whole
/// number. For an even phase the expected optical depth of each is its own, and so is its derivative: `dt` becomes larger by `thin`/τ,
/// which is held fixed.
/// Source: Madow 1949, systematic sampling with probabilities in proportion to size; as a march, Arvo and Kirk 1990, Russian roulette.
pub fn thinned<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
    thin: T,
    phase: T,
) -> Vec<QuadraturePoint<T>> {
    let mut due = phase;
    let keep = |q: &QuadraturePoint<T>| {
        let s = &path[q.segment];
        let y = sh::basis(field.degree, s.momentum.normalized());
        let tau = field.at(s.at(q.t), &y)?.density * q.dt * s.momentum.length();
        if tau >= thin || tau.is_nan() {
            return Some(*q);
        }
        let share = tau / thin;
        due += share;
        (due >= T::one()).then(|| {
            due -= T::one();
            QuadraturePoint { dt: q.dt / share, ..*q }
        })
    };
    points.iter().filter_map(keep).collect()
}

/// The phase of [`thinned`] where the points of a path are shifted by `offset` steps: as good as independent of it, and ½ in the middle
/// of a step.
#[inline]
pub fn thinning_phase<T: Real>(offset: T) -> T {
    const FINER: f64 = 4096.0;
    let x = offset * T::of(FINER) + T::of(0.5);
    x - x.floor()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radiance::{PixelAdjoint, quadrature, render, render_vjp};
    use crate::sh::ShDegree;
    use crate::{Aabb, BrickMap, Domain, Extent, Ray, vec3};

    const THIN: f64 = 0.05;
    const PHASES: usize = 1000;

    /// A ramp of thin haze before and behind something dense.
    fn haze() -> VoxelField<f64> {
        let domain = Domain::with_longest(Aabb::cube(1.0), Extent::Bounded, 16);
        let map = BrickMap::dense(domain.resolution);
        let mut field = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -9.0);
        for node in crate::grid::bricks::coordinates(domain.resolution) {
            let voxel = field.map.voxel(node);
            field.density[voxel] = if node[2] == 9 { 2.0 } else { -9.0 + 0.2 * f64::from(node[2]) };
        }
        field
    }

    /// A ray through it, and the points on it.
    fn marched(field: &VoxelField<f64>) -> ([Segment<f64>; 1], Vec<QuadraturePoint<f64>>) {
        let ray = Ray { origin: vec3(0.1, -0.2, -3.0), direction: vec3(0.05, 0.0, 1.0).normalized() };
        let path = [Segment::straight(&ray, &field.domain, 0.0).unwrap()];
        let points = quadrature(&field.domain, &path, 0.5 * field.domain.voxel(), 0.3);
        (path, points)
    }

    fn phases() -> impl Iterator<Item = f64> {
        (0..PHASES).map(|k| (k as f64 + 0.5) / PHASES as f64)
    }

    #[test]
    fn thinning_keeps_the_mean_optical_depth_and_leaves_out_most_points() {
        let field = haze();
        let (path, points) = marched(&field);
        let depth = |points: &[QuadraturePoint<f64>]| -render(&field, &path, points).transmittance.ln();
        let (mut mean, mut left) = (0.0, 0);
        for phase in phases() {
            let thinned = thinned(&field, &path, &points, THIN, phase);
            let error = (depth(&thinned) - depth(&points)).abs();
            assert!(error <= THIN + 1e-12, "no more than one point may be missing: {error}");
            (mean, left) = (mean + depth(&thinned) / PHASES as f64, left + thinned.len());
        }
        assert!((mean / depth(&points) - 1.0).abs() < 1e-3, "{mean} of {}", depth(&points));
        assert!(4 * left < PHASES * points.len(), "{left} of {} points", PHASES * points.len());
        assert_eq!(thinned(&field, &path, &points, 0.0, 0.3), points);
    }

    #[test]
    fn the_mean_gradient_of_optical_depth_is_that_of_all_points() {
        let field = haze();
        let (path, points) = marched(&field);
        // d(−ln T)/dθ = −(dT/dθ)/T.
        let gradient = |points: &[QuadraturePoint<f64>]| -> Vec<f64> {
            let transmittance = -render(&field, &path, points).transmittance.recip();
            let d = PixelAdjoint { colour: [0.0; 3], transmittance, behind: [0.0; 3] };
            let mut grad = field.zero_gradient();
            render_vjp(&field, &path, points, &d, &mut grad);
            grad.density.to_vec()
        };
        let want = gradient(&points);
        let mut mean = vec![0.0; want.len()];
        for phase in phases() {
            let thinned = gradient(&thinned(&field, &path, &points, THIN, phase));
            mean.iter_mut().zip(thinned).for_each(|(mean, g)| *mean += g / PHASES as f64);
        }
        let norm = |v: &[f64]| v.iter().map(|g| g * g).sum::<f64>().sqrt();
        let haze = |v: &[f64]| -> Vec<f64> {
            v.iter().zip(&field.density[..]).filter(|(_, theta)| **theta < 0.0).map(|(g, _)| *g).collect()
        };
        let apart: Vec<f64> = haze(&mean).iter().zip(haze(&want)).map(|(a, b)| a - b).collect();
        let error = norm(&apart) / norm(&haze(&want));
        assert!(error < 2.0 / (PHASES as f64).sqrt() && norm(&haze(&want)) > 0.0, "{error}");
    }

    #[test]
    fn phases_are_even_whatever_part_of_a_step_the_offset_is_in_and_one_half_in_its_middle() {
        assert_eq!(thinning_phase(0.5_f32), 0.5);
        const BINS: usize = 10;
        for first in [0.0, 0.3, 0.9] {
            let mut counts = [0; BINS];
            let phases = (0..100_000).map(|k| thinning_phase(first + 0.1 * (f64::from(k) + 0.5) / 1e5));
            phases.for_each(|phase| counts[(phase * BINS as f64) as usize] += 1);
            assert!(counts.iter().all(|n| (9_000..11_000).contains(n)), "{first}: {counts:?}");
        }
    }
}
