//! Where what was found without masks ends: place by place, its surface moves to where straight rays begin to fail, theory (4.23).
//!
//! The detector looks at cells of some pixels. When rays are to bend, straight rays have learned what lies beside that which was found,
//! and single pixels tell where it ends.

use super::context::Context;
use super::misfit::misfit;
use crate::backend::{Backend, Layers};
use crate::blur::gaussian_blur;
use crate::level_set::level_set;
use crate::model::Gate;
use crate::rays::{Selection, squared_errors};
use crate::schedule::training_marching;
use crate::silhouettes::{Outlines, Silhouette, Vote, hidden_beyond};
use rayon::prelude::*;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Aabb, Domain, Extent, LevelSet, Ray, Vec3};
use std::f32::consts::PI;

/// Rays inside and near outlines.
const RAYS: usize = 262_144;
/// Voxels along the longest edge of the surface at most: lengths below are in voxels, one of which is a pixel if these are enough.
const VOXELS: f32 = 128.0;
/// A surface moves by no more than this in a round [voxel].
const REACH: f32 = 8.0;
/// Rays that lie further than this from an outline surely belong to one side [voxel].
const SURELY: f32 = 4.0;
/// Distances that are tried lie so far apart [voxel].
const STEP: f32 = 0.5;
/// Edge of a place [voxel]; standard deviations of the blurs of what rays say over places, and of shifts [place].
const PLACE: f32 = 2.0;
const BLUR: f32 = 1.25;
const SMOOTH: f32 = 1.0;
/// Rays of all places that count at each: where few are seen, the surface moves as it does elsewhere.
const PRIOR: f32 = 20.0;
/// What has moved is seen at other places.
const ROUNDS: usize = 3;
/// Classes of misfits, of rays that show something opaque and of those that do not: white glass before a white sky is explained, and
/// says little.
const CLASSES: usize = 16;
/// The mean misfit must be so much larger within than beside, of 1: otherwise no outline is to be seen.
const CONTRAST: f64 = 0.1;

/// Outlines that were found anew.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    pub gate: Gate,
    /// Share of the variance of misfits that they explain, before and now.
    pub explained: [f64; 2],
}

/// A straight ray and how badly it fails.
#[derive(Clone, Copy, Debug)]
struct Sample {
    ray: Ray<f32>,
    /// e/(e + saturation), of 1.
    misfit: f64,
    /// Something opaque hides what lies further [scene unit].
    beyond: f32,
}

/// Where what is seen of a ray comes nearest to the inside of a surface.
#[derive(Clone, Copy, Debug)]
struct Grazing {
    place: Vec3<f32>,
    /// Signed distance from the surface there [voxel].
    height: f32,
    misfit: f64,
    /// The ray shows something opaque.
    shows: bool,
}

/// What was found with its surface where straight rays begin to fail; `None` if that explains their misfits no better.
pub(crate) fn outline(backend: &dyn Backend, known: &Context, found: &Gate) -> Option<Outline> {
    let Context { sampler, options, near, .. } = *known;
    let bounds = found.domain().bounds;
    let (longest, pixel) = (bounds.extent().max_element(), sampler.pixel_size(bounds.center()));
    let voxels = (longest / pixel).round().clamp(16.0, VOXELS);
    let domain = Domain::with_longest(bounds, Extent::Bounded, voxels as u32 + 1);
    let silhouettes: Vec<Silhouette> = sampler.masked_views().map(|v| Silhouette::of(&v, None)).collect();
    // Of votes a hull has cavities, which no view shows.
    let vote = Vote { share: options.shape.vote, ..Vote::default() };
    let distance = Outlines::new(&silhouettes).hull(&domain, &vote).distance;
    let hull = LevelSet::from_coefficients(bounds, domain.resolution, distance)?;

    let reach = (REACH * longest / voxels / pixel).ceil() as u32;
    let batch = sampler.batch(u64::MAX / 2 + 2, RAYS, Selection::Around(reach));
    let shown = backend.render(&batch.rays, &training_marching(options, near), Layers::All);
    let sample = |((ray, error), shown): ((&Ray<f32>, f64), &Pixel<f32>)| Sample {
        ray: *ray,
        misfit: misfit(error),
        beyond: hidden_beyond(shown),
    };
    let errors = squared_errors(&shown, &batch);
    let samples: Vec<Sample> = batch.rays.iter().zip(errors).zip(&shown).map(sample).collect();
    moved(hull, &samples)
}

fn moved(mut surface: LevelSet<f32>, samples: &[Sample]) -> Option<Outline> {
    surface.redistance();
    let mut seen = grazing(&surface, samples);
    let before = explained(&seen);
    for _ in 0..ROUNDS {
        let Domain { bounds, resolution, .. } = *surface.domain();
        let (shifts, voxel) = (shifts(&seen, surface.domain())?, surface.voxel());
        let old = surface;
        surface = level_set(bounds, resolution, |x| distance(&old, x) - voxel * shifts.value(x));
        surface.redistance();
        seen = grazing(&surface, samples);
    }
    let explained = [before, explained(&seen)];
    let share = |j: usize| (0.5 - surface.value(surface.position(j)) / surface.voxel()).clamp(0.0, 1.0);
    let share: Vec<f32> = (0..surface.coefficients().len()).into_par_iter().map(share).collect();
    let gate = || Gate::new(*surface.domain(), &share);
    (explained[1] > explained[0]).then(|| Outline { gate: gate(), explained })
}

/// Where the values of a level set are distances: not at the border of its grid.
fn inner(surface: &LevelSet<f32>) -> Aabb<f32> {
    let (bounds, room) = (surface.domain().bounds, Vec3::splat(2.0 * surface.voxel()));
    Aabb::new(bounds.min + room, bounds.max - room)
}

/// Signed distance from a surface, also at the border of its grid [scene unit].
fn distance(surface: &LevelSet<f32>, x: Vec3<f32>) -> f32 {
    let within = inner(surface);
    let near = x.zip(within.min, f32::max).zip(within.max, f32::min);
    surface.value(near) + (x - near).length()
}

/// Where rays come nearest to the inside, of those that pass through the box of the surface.
fn grazing(surface: &LevelSet<f32>, samples: &[Sample]) -> Vec<Grazing> {
    let voxel = surface.voxel();
    let nearest = |sample: &Sample| {
        let Sample { ray, misfit, beyond } = *sample;
        let [enter, leave] = inner(surface).clip(&ray)?;
        let (mut s, mut least): (f32, Option<(f32, f32)>) = (enter, None);
        while s <= leave.min(beyond) {
            let height = surface.value(ray.at(s));
            let (lowest, _) = *least.get_or_insert((height, s));
            if height < lowest {
                least = Some((height, s));
            }
            s += (0.5 * voxel).max(height - lowest); // φ changes by no more than the distance
        }
        least.map(|(height, s)| Grazing {
            place: ray.at(s),
            height: height / voxel,
            misfit,
            shows: beyond.is_finite(),
        })
    };
    samples.par_iter().filter_map(nearest).collect()
}

/// Share of the variance of misfits that the sign of the height explains, of rays that show something.
fn explained(seen: &[Grazing]) -> f64 {
    let (mut sums, mut squares) = ([[0.0_f64; 2]; 2], 0.0);
    for g in seen.iter().filter(|g| g.shows) {
        let side = &mut sums[usize::from(g.height < 0.0)];
        side[0] += 1.0;
        side[1] += g.misfit;
        squares += g.misfit * g.misfit;
    }
    let [[beside, b], [within, w]] = sums;
    let all = beside + within;
    let variance = squares / all - ((b + w) / all).powi(2);
    let step = if beside > 0.0 && within > 0.0 { (w / within - b / beside).max(0.0) } else { 0.0 };
    if variance > 0.0 { beside * within / (all * all) * step * step / variance } else { 0.0 }
}

/// What rays of each class of misfits say: log(p(class | within) / p(class | beside)).
struct Support([[f32; CLASSES]; 2]);

impl Support {
    /// By rays that surely lie on one side; `None` where misfits hardly differ.
    fn of(seen: &[Grazing]) -> Option<Self> {
        let (mut counts, mut sums) = ([[[1.0_f64; CLASSES]; 2]; 2], [[0.0_f64; 2]; 2]);
        for g in seen.iter().filter(|g| (SURELY..2.0 * REACH).contains(&g.height.abs())) {
            let side = usize::from(g.height < 0.0);
            counts[usize::from(g.shows)][side][class(g.misfit)] += 1.0;
            sums[side][0] += 1.0;
            sums[side][1] += g.misfit;
        }
        let [beside, within] = sums.map(|[n, sum]| sum / n.max(1.0));
        let ratio = |[beside, within]: [[f64; CLASSES]; 2]| -> [f32; CLASSES] {
            let [all_beside, all_within] = [beside, within].map(|counts| counts.iter().sum::<f64>());
            std::array::from_fn(|k| (within[k] / all_within / (beside[k] / all_beside)).ln() as f32)
        };
        (within - beside >= CONTRAST).then(|| Self(counts.map(ratio)))
    }

    fn by(&self, g: &Grazing) -> f32 {
        self.0[usize::from(g.shows)][class(g.misfit)]
    }
}

fn class(misfit: f64) -> usize {
    ((misfit * CLASSES as f64) as usize).min(CLASSES - 1)
}

/// How far outside of the surface its rays say that it should be [voxel], as a function of the place.
fn shifts(seen: &[Grazing], domain: &Domain<f32>) -> Option<LevelSet<f32>> {
    let support = Support::of(seen)?;
    let resolution = domain.resolution.map(|n| (((n - 1) as f32 / PLACE).round() as u32 + 1).max(7));
    let places = Domain { resolution, ..*domain };
    let n = resolution.map(|n| n as usize);
    let bins = (2.0 * REACH / STEP) as usize;
    // Per bin of heights what its rays say at each place.
    let mut sums = vec![vec![0.0_f32; n.iter().product()]; bins];
    let near = || seen.iter().filter(|g| g.height.abs() < REACH);
    for g in near() {
        let at = places.node(g.place).map(f32::round).to_array();
        let [x, y, z] = [0, 1, 2].map(|a| (at[a].max(0.0) as usize).min(n[a] - 1));
        let bin = (((g.height + REACH) / STEP) as usize).min(bins - 1);
        sums[bin][x + n[0] * (y + n[1] * z)] += support.by(g);
    }
    let rays = near().count().max(1) as f32;
    sums.par_iter_mut().for_each(|sums| {
        let all: f32 = sums.iter().sum();
        gaussian_blur(sums, resolution, BLUR);
        // A blur leaves 1/(4πσ²) of what lies on a surface in its middle.
        let whole = 4.0 * PI * BLUR * BLUR;
        sums.iter_mut().for_each(|sum| *sum = whole * *sum + PRIOR * all / rays);
    });
    let best = |place: usize| {
        let (mut sum, mut best) = (0.0, (0.0, 0));
        for (k, sums) in sums.iter().enumerate() {
            sum += sums[place];
            if sum > best.0 {
                best = (sum, k + 1);
            }
        }
        STEP * best.1 as f32 - REACH
    };
    let mut shifts: Vec<f32> = (0..n.iter().product()).into_par_iter().map(best).collect();
    gaussian_blur(&mut shifts, resolution, SMOOTH);
    LevelSet::from_coefficients(domain.bounds, resolution, shifts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use refraxel_core::vec3;

    const NODES: u32 = 65;

    /// Distance from the true body, a ball that is flattened.
    fn truth(x: Vec3<f32>) -> f32 {
        (vec3(x.x, x.y, 1.25 * x.z).length() - 0.5) / 1.25
    }

    /// Rays past it from all sides, that fail as often as this inside and beside.
    fn samples(failing: [f64; 2]) -> Vec<Sample> {
        let random = Random::new(7);
        let sample = |k: u64| {
            let u = |lane: u64| 2.0 * random.uniform(k, lane) as f32 - 1.0;
            let (z, angle) = (u(0), PI * u(1));
            let r = (1.0 - z * z).sqrt();
            let origin = vec3(r * angle.cos(), r * angle.sin(), z) * 4.0;
            let direction = (vec3(u(2), u(3), u(4)) * 0.75 - origin).normalized();
            let ray = Ray { origin, direction };
            let meets = (0..400).any(|i| truth(ray.at(2.0 + 0.01 * i as f32)) < 0.0);
            let fails = random.uniform(k, 5) < failing[usize::from(!meets)];
            let misfit = if fails { 0.9 } else { 0.1 } + 0.1 * random.uniform(k, 6);
            Sample { ray, misfit, beyond: 8.0 }
        };
        (0..60_000).map(sample).collect()
    }

    /// Mean distance of a gate's surface from the true one [voxel].
    fn error(gate: &Gate) -> f32 {
        let voxel = gate.domain().voxel();
        let near = |x: &Vec3<f32>| truth(*x).abs() < 6.0 * voxel;
        let domain = *gate.domain();
        let nodes = (0..gate.values().len()).map(|j| domain.place(j));
        let wrong = nodes.filter(near).filter(|x| gate.is_inside(*x) != (truth(*x) < 0.0)).count();
        let nodes = (0..gate.values().len()).map(|j| domain.place(j));
        let surface = nodes.filter(|x| truth(*x).abs() < 0.5 * voxel).count();
        wrong as f32 / surface as f32
    }

    /// A ball beside its place, of another shape.
    fn rough() -> LevelSet<f32> {
        LevelSet::from_samples(Aabb::cube(1.0), [NODES; 3], |x| (x - vec3(0.05, 0.0, -0.03)).length() - 0.47)
    }

    #[test]
    fn a_surface_moves_to_where_straight_rays_begin_to_fail_place_by_place() {
        let start = Gate::new(*rough().domain(), &shares(&rough()));
        let Outline { gate, explained } = moved(rough(), &samples([0.8, 0.3])).unwrap();
        let [before, after] = [&start, &gate].map(error);
        assert!(before > 1.0 && after < 0.2, "{before} {after}");
        assert!(explained[1] > explained[0], "{explained:?}");
    }

    fn shares(surface: &LevelSet<f32>) -> Vec<f32> {
        let value = |j: usize| surface.value(surface.position(j)) / surface.voxel();
        (0..surface.coefficients().len()).map(|j| (0.5 - value(j)).clamp(0.0, 1.0)).collect()
    }

    #[test]
    fn where_straight_rays_fail_as_often_beside_it_a_surface_stays() {
        assert!(moved(rough(), &samples([0.5, 0.5])).is_none());
        assert!(moved(rough(), &[]).is_none());
    }

    #[test]
    fn what_opaque_things_hide_says_nothing() {
        let hidden = |s: Sample| Sample { beyond: 2.0, ..s };
        let samples: Vec<Sample> = samples([0.8, 0.3]).into_iter().map(hidden).collect();
        assert!(moved(rough(), &samples).is_none());
    }
}
