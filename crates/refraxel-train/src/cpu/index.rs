//! The index and its surfaces learn: index_samples are scattered to the grids, their gradients are blurred, and Adam takes a step.

use super::tape::{IndexSample, Tape, sum_in_parts};
use crate::backend::IndexObjective;
use crate::initial::gaussian_blur;
use crate::polyhedron::Polyhedron;
use crate::refraction::{Refraction, RegionState};
use rayon::prelude::*;
use refraxel_core::index::{MediumGradient, priors};
use refraxel_core::{IndexGrid, LevelSet, Medium};

/// Adam's decays: of the mean, and of the mean square.
const DECAY: [f32; 2] = [0.9, 0.99];
/// The same of the nodes of a surface: each is met by few rays of a step, and trembles the less the longer it remembers.
const DECAY_OF_NODES: [f32; 2] = [0.97, 0.99];
/// Floor of Adam's denominator, as a share of the largest: voxels that hardly matter must not follow noise.
const FLOOR: f32 = 0.1;
/// Steps after which the rate of a surface has halved; from there on it falls with their number (Robbins & Monro 1951):
/// colours cannot settle behind a surface that trembles. Nodes have further to go than planes.
const HALF_OF_PLANES: f32 = 50.0;
const HALF_OF_NODES: f32 = 150.0;
/// Steps between two looks at what is flat.
const REFRESH: u64 = 16;

/// Adam's moments of one array of parameters, and how many steps they saw.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AdamMoments {
    /// Mean of the gradient.
    pub first: Vec<f32>,
    /// Mean of its square.
    pub second: Vec<f32>,
    /// Steps taken.
    pub steps: u32,
}

/// The moments of one region.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct IndexMoments {
    /// Of the coefficients of w.
    pub index: AdamMoments,
    /// Of the coefficients of φ; empty without a surface. The first are those of the planes' parameters where planes learn.
    pub surface: AdamMoments,
}

impl AdamMoments {
    fn zero(n: usize) -> Self {
        Self { first: vec![0.0; n], second: vec![0.0; n], steps: 0 }
    }

    /// The change of each of the parameters `which`, for a learning rate of 1.
    fn steps(&mut self, decay: [f32; 2], which: &[usize], grad: impl Fn(usize) -> f32) -> Vec<f32> {
        self.steps += 1;
        let unbias = decay.map(|d| (1.0 - d.powi(self.steps.min(1 << 20) as i32)).recip());
        let mut largest = 0.0_f32;
        for &j in which {
            let g = grad(j);
            self.first[j] += (1.0 - decay[0]) * (g - self.first[j]);
            self.second[j] += (1.0 - decay[1]) * (g * g - self.second[j]);
            largest = largest.max(self.second[j]);
        }
        let floor = FLOOR * (largest * unbias[1]).sqrt() + f32::MIN_POSITIVE;
        let step = |&j: &usize| -self.first[j] * unbias[0] / (self.second[j] * unbias[1]).sqrt().max(floor);
        which.iter().map(step).collect()
    }
}

impl IndexMoments {
    pub(super) fn zero(grid: &IndexGrid<f32>) -> Self {
        let surface = grid.level_set().map_or(0, |l| l.coefficients().len());
        Self { index: AdamMoments::zero(grid.coefficients().len()), surface: AdamMoments::zero(surface) }
    }
}

/// dLoss/dcoefficients from the index_samples of all tapes, each bounded by `clip`.
pub(super) fn gradient(medium: &Medium<f32>, tapes: &[Tape], clip: f32) -> MediumGradient<f32> {
    let scatter = |sums: &mut MediumGradient<f32>, tape: &Tape| {
        tape.index_samples.iter().for_each(|index_sample| add(medium, index_sample, clip, sums));
    };
    let merge = |total: &mut MediumGradient<f32>, part: MediumGradient<f32>| {
        let arrays = total.index.iter_mut().chain(&mut total.level_set);
        for (total, part) in arrays.zip(part.index.iter().chain(&part.level_set)) {
            total.par_iter_mut().zip(part).for_each(|(t, p)| *t += p);
        }
    };
    sum_in_parts(tapes, || medium.zero_gradient(), scatter, merge)
}

fn add(medium: &Medium<f32>, index_sample: &IndexSample, clip: f32, sums: &mut MediumGradient<f32>) {
    let (region, (d_value, d_gradient)) = (index_sample.region as usize, index_sample.d);
    let grid = &medium.regions()[region];
    let slope = d_gradient.length();
    if !(slope.is_finite() && d_value.is_finite()) {
        return; // a path so chaotic that its derivative overflowed says nothing
    }
    // What a smooth transition mirrors depends on w itself.
    let of_value = if grid.level_set().is_none() { d_value.abs() * grid.voxel() } else { 0.0 };
    let size = slope.max(of_value);
    let scale = if size > clip { clip / size } else { 1.0 };
    let (d_value, d_gradient) = (d_value * scale, d_gradient * scale);
    match grid.level_set().filter(|_| index_sample.surface) {
        Some(level) => level.scatter(index_sample.x, d_value, d_gradient, &mut sums.level_set[region]),
        None => grid.scatter(index_sample.x, d_value, d_gradient, &mut sums.index[region]),
    }
}

/// One step of every region.
pub(super) fn update(
    refraction: &mut Refraction,
    moments: &mut [IndexMoments],
    (tapes, rays, step): (&[Tape], usize, u64),
    objective: &IndexObjective,
) {
    let grads = gradient(&refraction.medium, tapes, objective.clip);
    let arrays = grads.index.into_iter().zip(grads.level_set);
    for (region, ((mut grad, mut surface), moments)) in arrays.zip(moments).enumerate() {
        let states = refraction.states.get_mut(region);
        let searched = states.as_ref().and_then(|e| e.searched);
        let mut solid = None;
        if let Some(states) = states {
            solid = states.solid.as_mut();
        }
        if let Some(level) = refraction.medium.region_mut(region).level_set_mut() {
            learn_surface((level, solid), &mut moments.surface, &mut surface, objective);
        }
        let free = refraction.states.get(region).and_then(RegionState::free);
        let grid = refraction.medium.region_mut(region);
        if let (Some(n), Some(_)) = (grid.interior_index(), grid.level_set()) {
            descend_one(grid, (n, searched), &mut moments.index, &grad, objective);
        } else {
            add_priors(grid, rays as f32, objective, &mut grad);
            gaussian_blur(&mut grad, grid.domain().resolution, objective.blur);
            descend(grid, free, &mut moments.index, &grad, objective);
            if step.is_multiple_of(REFRESH) {
                grid.find_flat_cells(free);
            }
        }
    }
}

/// One step of a surface, unless it is held fixed.
fn learn_surface(
    (level, solid): (&mut LevelSet<f32>, Option<&mut Polyhedron>),
    moments: &mut AdamMoments,
    grad: &mut [f32],
    objective: &IndexObjective,
) {
    if objective.surface_rate <= 0.0 {
        return;
    }
    if let Some(solid) = solid {
        descend_solid(level, solid, moments, grad, objective);
    } else {
        gaussian_blur(grad, level.domain().resolution, objective.surface_blur);
        descend_surface(level, moments, grad, objective);
    }
}

/// Priors count per ray, like the loss.
fn add_priors(grid: &IndexGrid<f32>, rays: f32, objective: &IndexObjective, grad: &mut [f32]) {
    let (weight, penalty) = objective.variation;
    if weight > 0.0 {
        priors::variation_vjp(grid, penalty, weight * rays, grad);
    }
    let (weight, penalty) = objective.deviation;
    if weight > 0.0 {
        priors::deviation_vjp(grid, 1.0, penalty, weight * rays, grad);
    }
}

/// Adam on n = √(2c) at the free nodes.
fn descend(
    grid: &mut IndexGrid<f32>,
    free: Option<&[bool]>,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    if objective.rate <= 0.0 {
        return;
    }
    let nodes: Vec<usize> = grid.parameters().filter(|&j| free.is_none_or(|f| f[j])).collect();
    let coefficients = grid.coefficients_mut();
    let steps = moments.steps(DECAY, &nodes, |j| grad[j] * (2.0 * coefficients[j]).sqrt()); // dc/dn = n
    for (&j, step) in nodes.iter().zip(steps) {
        let n = ((2.0 * coefficients[j]).sqrt() + objective.rate * step).clamp(1.0, objective.largest);
        coefficients[j] = 0.5 * n * n;
    }
}

/// Adam on the one index of a body; by dw = n dn its derivative is n times the sum of the coefficients'.
fn descend_one(
    grid: &mut IndexGrid<f32>,
    (n, searched): (f32, Option<f32>),
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    if objective.rate > 0.0 {
        let d_n = n * grad.iter().sum::<f32>();
        let step = moments.steps(DECAY, &[0], |_| d_n)[0];
        let [low, high] =
            searched.map_or([1.0, objective.largest], |s| [s - objective.trust, s + objective.trust]);
        grid.set_interior_index((n + objective.rate * step).max(low.max(1.0)).min(high));
    }
}

/// The rate of a surface [scene unit], and how much less it is after so many steps, when it halves in `half`.
fn surface_rate(
    level: &LevelSet<f32>,
    (moments, half): (&AdamMoments, f32),
    objective: &IndexObjective,
) -> [f32; 2] {
    let slower = half / (half + moments.steps as f32);
    [objective.surface_rate * slower * level.voxel(), slower]
}

/// Adam on the faces of a polyhedron.
fn descend_solid(
    level: &mut LevelSet<f32>,
    solid: &mut Polyhedron,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    let [rate, _] = surface_rate(level, (moments, HALF_OF_PLANES), objective);
    let grad = solid.vjp(level, grad);
    let which: Vec<usize> = (0..grad.len()).collect();
    let steps: Vec<f32> = moments.steps(DECAY, &which, |j| grad[j]).iter().map(|s| rate * s).collect();
    solid.advance(level, &steps);
    *level = solid.level_set(level.domain().bounds, level.domain().resolution);
}

/// Adam on φ, then a little smoothing: what one pixel wants must not become a dent.
fn descend_surface(
    level: &mut LevelSet<f32>,
    moments: &mut AdamMoments,
    grad: &[f32],
    objective: &IndexObjective,
) {
    let nodes: Vec<usize> = level.parameters().filter(|&j| grad[j] != 0.0).collect();
    let [rate, slower] = surface_rate(level, (moments, HALF_OF_NODES), objective);
    let steps = moments.steps(DECAY_OF_NODES, &nodes, |j| grad[j]);
    for (&j, step) in nodes.iter().zip(steps) {
        level.coefficients_mut()[j] += rate * step;
    }
    if objective.surface_smooth > 0.0 {
        level.smooth(objective.surface_smooth * slower);
    } else {
        level.find_surface();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use refraxel_core::index::priors::Penalty;
    use refraxel_core::{Aabb, Vec3};

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
        most_events: 8,
    };

    /// A dented ball after `steps` steps without any ray that met it.
    fn dented(steps: u64, objective: &IndexObjective) -> LevelSet<f32> {
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let ball = LevelSet::from_samples(cube, [25; 3], |x: Vec3<f32>| x.length() - 0.6);
        let random = Random::new(1);
        let dent = |j: usize| 0.03 * (random.uniform(j as u64, 0) as f32 - 0.5);
        let rough = ball.coefficients().iter().enumerate().map(|(j, c)| c + dent(j)).collect();
        let level = LevelSet::from_coefficients(cube, [25; 3], rough).unwrap();
        let grid = IndexGrid::sharp(level, 1.5);
        let mut moments = [IndexMoments::zero(&grid)];
        let mut refraction = Refraction::none();
        refraction.medium = Medium::new(vec![grid]).unwrap();
        refraction.states = vec![Default::default()];
        (0..steps).for_each(|step| update(&mut refraction, &mut moments, (&[], 64, step), objective));
        refraction.medium.regions()[0].level_set().unwrap().clone()
    }

    #[test]
    fn paths_whose_derivative_overflowed_teach_nothing() {
        let cube = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let grid = IndexGrid::vacuum(cube, [9; 3], refraxel_core::Interpolation::CubicBSpline);
        let medium = Medium::new(vec![grid]).unwrap();
        let index_sample = |d: f32| IndexSample {
            region: 0,
            surface: false,
            x: Vec3::zero(),
            d: (0.0, Vec3::new(d, 0.0, 1.0)),
        };
        let of = |index_samples: &[IndexSample]| {
            let mut tape = Tape::default();
            tape.index_samples.extend_from_slice(index_samples);
            gradient(&medium, &[tape], 1.0).index[0].clone()
        };
        assert!(of(&[index_sample(2.0)]).iter().any(|g| *g != 0.0));
        assert_eq!(
            of(&[index_sample(2.0), index_sample(f32::INFINITY), index_sample(f32::NAN)]),
            of(&[index_sample(2.0)])
        );
    }

    #[test]
    fn a_surface_without_a_rate_stays_bit_by_bit() {
        let still = IndexObjective { surface_rate: 0.0, surface_smooth: 0.1, ..OBJECTIVE };
        let learning = IndexObjective { rate: 0.01, ..still };
        assert_eq!(dented(5, &learning).coefficients(), dented(0, &learning).coefficients());
    }
}
