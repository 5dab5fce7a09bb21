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
        if tau >= thin {
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
    use crate::radiance::{quadrature, render};
    use crate::sh::ShDegree;
    use crate::{Aabb, BrickMap, Domain, Extent, Ray, vec3};

    /// A ramp of thin haze before and behind something dense.
    fn haze() -> VoxelField<f64> {
        let domain = Domain::with_longest(Aabb::cube(1.0), Extent::Bounded, 16);
        let map = BrickMap::dense(domain.resolution);
        let mut field = VoxelField::uniform(domain, map, ShDegree::new(0).unwrap(), -9.0);
        for node in crate::grid::bricks::coordinates(domain.resolution) {
            let voxel = field.map.voxel(node);
            field.density[voxel] = if node[2] == 9 { 2.0 } else { -9.0 + 0.2 * node[2] as f64 };
        }
        field
    }

    #[test]
    fn thinning_keeps_the_mean_optical_depth_and_leaves_out_most_points() {
        const THIN: f64 = 0.05;
        const PHASES: usize = 1000;
        let field = haze();
        let ray = Ray { origin: vec3(0.1, -0.2, -3.0), direction: vec3(0.05, 0.0, 1.0).normalized() };
        let path = [Segment::straight(&ray, &field.domain, 0.0).unwrap()];
        let points = quadrature(&field.domain, &path, 0.5 * field.domain.voxel(), 0.3);
        let depth = |points: &[QuadraturePoint<f64>]| -render(&field, &path, points).transmittance.ln();
        let (mut mean, mut left) = (0.0, 0);
        for k in 0..PHASES {
            let thinned = thinned(&field, &path, &points, THIN, (k as f64 + 0.5) / PHASES as f64);
            let error = (depth(&thinned) - depth(&points)).abs();
            assert!(error <= THIN + 1e-12, "no more than one point may be missing: {error}");
            (mean, left) = (mean + depth(&thinned) / PHASES as f64, left + thinned.len());
        }
        assert!((mean / depth(&points) - 1.0).abs() < 1e-3, "{mean} of {}", depth(&points));
        assert!(4 * left < PHASES * points.len(), "{left} of {} points", PHASES * points.len());
        assert_eq!(thinned(&field, &path, &points, 0.0, 0.3), points);
    }

    #[test]
    fn phases_are_even_and_in_the_middle_of_a_step_one_half() {
        assert_eq!(thinning_phase(0.5_f32), 0.5);
        let mean = (0..100_000).map(|k| thinning_phase((f64::from(k) + 0.5) / 1e5)).sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 1e-2, "{mean}");
    }
}
