//! The index and its surfaces learn: index samples are scattered to the grids, whose gradients take a [step](descent).

use super::record::IndexSample;
use super::tape::{Tape, sum_in_parts};
use crate::backend::IndexObjective;
use crate::descent;
use crate::model::{IndexMoments, Refraction};
use rayon::prelude::*;
use refraxel_core::Medium;
use refraxel_core::index::MediumGradient;

/// What a step has learned from its rays.
pub(super) struct Learned<'a> {
    pub tapes: &'a [Tape],
    /// Rays of the batch.
    pub rays: usize,
    pub step: u64,
}

/// dLoss/dcoefficients from the index samples of all tapes, each bounded by `clip`.
pub(super) fn gradient(medium: &Medium<f32>, tapes: &[Tape], clip: f32) -> MediumGradient<f32> {
    let scatter = |sums: &mut MediumGradient<f32>, tape: &Tape| {
        tape.index_samples.iter().for_each(|sample| add(medium, sample, clip, sums));
    };
    let merge = |total: &mut MediumGradient<f32>, part: MediumGradient<f32>| {
        let arrays = total.index.iter_mut().chain(&mut total.level_set);
        for (total, part) in arrays.zip(part.index.iter().chain(&part.level_set)) {
            total.par_iter_mut().zip(part).for_each(|(t, p)| *t += p);
        }
    };
    sum_in_parts(tapes, || medium.zero_gradient(), scatter, merge)
}

/// Index samples of the tapes that are left out, and lengths of paths in what absorbs.
pub(super) fn overflows(tapes: &[Tape]) -> u64 {
    let of = |tape: &Tape| {
        tape.overflows + tape.index_samples.iter().filter(|sample| has_overflowed(sample)).count() as u64
    };
    tapes.par_iter().map(of).sum()
}

fn has_overflowed(sample: &IndexSample) -> bool {
    !(sample.d_gradient.length().is_finite() && sample.d_value.is_finite())
}

fn add(medium: &Medium<f32>, sample: &IndexSample, clip: f32, sums: &mut MediumGradient<f32>) {
    let IndexSample { x, d_value, d_gradient, .. } = *sample;
    let region = sample.region as usize;
    let grid = &medium.regions()[region];
    if has_overflowed(sample) {
        return; // a path so chaotic that its derivative overflowed says nothing
    }
    let slope = d_gradient.length();
    // What a smooth transition mirrors depends on w itself.
    let of_value = if grid.level_set().is_none() { d_value.abs() * grid.voxel() } else { 0.0 };
    let size = slope.max(of_value);
    let scale = if size > clip { clip / size } else { 1.0 };
    let (d_value, d_gradient) = (d_value * scale, d_gradient * scale);
    match grid.level_set().filter(|_| sample.surface) {
        Some(level) => level.scatter(x, d_value, d_gradient, &mut sums.level_set[region]),
        None => grid.scatter(x, d_value, d_gradient, &mut sums.index[region]),
    }
}

/// One step of every region. False when a parameter or a moment left the finite numbers.
pub(super) fn update(
    refraction: &mut Refraction,
    moments: &mut [IndexMoments],
    learned: &Learned,
    objective: &IndexObjective,
) -> bool {
    let gradient = gradient(&refraction.medium, learned.tapes, objective.clip);
    let learned = descent::IndexStep { gradient, rays: learned.rays, step: learned.step };
    descent::update_index(refraction, moments, learned, objective)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use refraxel_core::index::priors::Penalty;
    use refraxel_core::{Aabb, IndexGrid, LevelSet, Vec3};

    const OBJECTIVE: IndexObjective = IndexObjective {
        rate: 0.0,
        blur: 1.0,
        clip: 1.0,
        variation: (0.0, Penalty::Squared),
        deviation: (0.0, Penalty::Squared),
        largest: 2.0,
        trust: 0.02,
        surface_rate: 0.05,
        surface_blur: 1.0,
        surface_smooth: 0.0,
        silhouette: 0.0,
        surface_events: 8,
        index_events: 8,
    };

    /// A dented ball after `steps` steps without any ray that met it.
    fn dented(steps: u64, objective: &IndexObjective) -> LevelSet<f32> {
        let cube = Aabb::cube(1.0);
        let ball = LevelSet::from_samples(cube, [25; 3], |x: Vec3<f32>| x.length() - 0.6);
        let random = Random::new(1);
        let dent = |j: usize| 0.03 * (random.uniform(j as u64, 0) as f32 - 0.5);
        let rough = ball.coefficients().iter().enumerate().map(|(j, c)| c + dent(j)).collect();
        let level = LevelSet::from_coefficients(cube, [25; 3], rough).unwrap();
        let grid = IndexGrid::sharp(level, 1.5);
        let mut moments = [IndexMoments::zero(&grid)];
        let mut refraction = Refraction::of(vec![grid]);
        (0..steps).for_each(|step| {
            assert!(update(&mut refraction, &mut moments, &Learned { tapes: &[], rays: 64, step }, objective))
        });
        refraction.medium.regions()[0].level_set().unwrap().clone()
    }

    #[test]
    fn paths_whose_derivative_overflowed_teach_nothing_and_are_counted() {
        let cube = Aabb::cube(1.0);
        let grid = IndexGrid::vacuum(cube, [9; 3], refraxel_core::Interpolation::CubicBSpline);
        let medium = Medium::new(vec![grid]).unwrap();
        let index_sample = |d: f32| IndexSample {
            region: 0,
            surface: false,
            x: Vec3::zero(),
            d_value: 0.0,
            d_gradient: Vec3::new(d, 0.0, 1.0),
        };
        let of = |index_samples: &[IndexSample]| {
            let mut tape = Tape::default();
            tape.index_samples.extend_from_slice(index_samples);
            let tapes = [tape];
            (gradient(&medium, &tapes, 1.0).index[0].clone(), overflows(&tapes))
        };
        let (usual, none) = of(&[index_sample(2.0)]);
        assert!(usual.iter().any(|g| *g != 0.0) && none == 0);
        assert_eq!(of(&[index_sample(2.0), index_sample(f32::INFINITY), index_sample(f32::NAN)]), (usual, 2));
    }

    #[test]
    fn an_index_that_is_held_does_not_learn_and_one_beside_it_does() {
        let cube = Aabb::cube(1.0);
        let ball = |radius: f32, n: f32| {
            IndexGrid::sharp(LevelSet::from_samples(cube, [15; 3], |x: Vec3<f32>| x.length() - radius), n)
        };
        let grids = vec![ball(0.6, 1.5), ball(0.3, 1.0)];
        let mut moments: Vec<IndexMoments> = grids.iter().map(IndexMoments::zero).collect();
        let mut refraction = Refraction::of(grids);
        refraction.states[1].fixed_index = true;
        let sample = |region| IndexSample {
            region,
            surface: false,
            x: Vec3::zero(),
            d_value: -1.0,
            d_gradient: Vec3::zero(),
        };
        let mut tape = Tape::default();
        tape.index_samples.extend([sample(0), sample(1)]);
        let learned = Learned { tapes: &[tape], rays: 1, step: 0 };
        assert!(update(&mut refraction, &mut moments, &learned, &IndexObjective { rate: 0.01, ..OBJECTIVE }));
        let indices: Vec<f32> =
            refraction.medium.regions().iter().map(|r| r.interior_index().unwrap()).collect();
        assert!(indices[0] > 1.505 && indices[1] == 1.0, "{indices:?}");
    }

    #[test]
    fn a_surface_that_is_held_stays_while_its_index_learns() {
        let cube = Aabb::cube(1.0);
        let ball = LevelSet::from_samples(cube, [15; 3], |x: Vec3<f32>| x.length() - 0.6);
        let sample = |surface| IndexSample {
            region: 0,
            surface,
            x: Vec3 { x: if surface { 0.6 } else { 0.0 }, y: 0.0, z: 0.0 },
            d_value: -1.0,
            d_gradient: Vec3::zero(),
        };
        let mut tapes = [Tape::default()];
        tapes[0].index_samples.extend([sample(true), sample(false)]);
        for fixed_surface in [false, true] {
            let grids = vec![IndexGrid::sharp(ball.clone(), 1.5)];
            let mut moments: Vec<IndexMoments> = grids.iter().map(IndexMoments::zero).collect();
            let mut refraction = Refraction::of(grids);
            refraction.states[0].fixed_surface = fixed_surface;
            let learned = Learned { tapes: &tapes, rays: 1, step: 0 };
            assert!(update(
                &mut refraction,
                &mut moments,
                &learned,
                &IndexObjective { rate: 0.01, ..OBJECTIVE }
            ));
            let body = &refraction.medium.regions()[0];
            assert!(body.interior_index().unwrap() > 1.505);
            let stayed = body.level_set().unwrap().coefficients() == ball.coefficients();
            assert_eq!(stayed, fixed_surface);
        }
    }

    /// A gradient of 1e30 has a square that no f32 can hold: without a bound on samples it must not pass for a step of 0.
    #[test]
    fn an_index_or_surface_whose_moments_overflow_fails_the_step_and_stays() {
        let cube = Aabb::cube(1.0);
        let ball = LevelSet::from_samples(cube, [15; 3], |x: Vec3<f32>| x.length() - 0.6);
        let smooth = IndexGrid::vacuum(cube, [9; 3], refraxel_core::Interpolation::CubicBSpline);
        let objective = IndexObjective { rate: 0.01, clip: f32::INFINITY, ..OBJECTIVE };
        for (grid, surface) in [
            (IndexGrid::sharp(ball.clone(), 1.5), true),
            (IndexGrid::sharp(ball, 1.5), false),
            (smooth, false),
        ] {
            let x = Vec3 { x: if surface { 0.6 } else { 0.0 }, y: 0.0, z: 0.0 };
            let mut moments = [IndexMoments::zero(&grid)];
            let mut refraction = Refraction::of(vec![grid]);
            let before = refraction.medium.regions()[0].clone();
            let mut step = |d_value: f32| {
                let mut tape = Tape::default();
                let d_gradient = Vec3::zero();
                tape.index_samples.push(IndexSample { region: 0, surface, x, d_value, d_gradient });
                let learned = Learned { tapes: &[tape], rays: 1, step: 1 };
                update(&mut refraction, &mut moments, &learned, &objective)
            };
            assert!(!step(1e30));
            let after = &refraction.medium.regions()[0];
            assert_eq!(after.coefficients(), before.coefficients());
            assert_eq!(after.interior_index(), before.interior_index());
            let level = |grid: &IndexGrid<f32>| grid.level_set().map(|l| l.coefficients().to_vec());
            assert_eq!(level(after), level(&before));
        }
    }

    #[test]
    fn a_surface_without_a_rate_stays_bit_by_bit() {
        let still = IndexObjective { surface_rate: 0.0, surface_smooth: 0.1, ..OBJECTIVE };
        let learning = IndexObjective { rate: 0.01, ..still };
        assert_eq!(dented(5, &learning).coefficients(), dented(0, &learning).coefficients());
    }
}
