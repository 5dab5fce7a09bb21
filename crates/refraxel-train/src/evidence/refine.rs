//! The surface and the index of a body by the gradient of the score, with the field held fixed: theory (4.25).
//!
//! Masks tell a surface to a pixel or two, and its slopes hardly at all, yet slopes decide where rays go. The score of predictions has a
//! gradient: that of the comparison, of what exit rays meet in the field, and of the path by Snell's law. It is followed from coarse
//! pictures and few nodes to fine ones. Outlines hold the surface where the score says nothing.

use super::detail::Detail;
use super::photographs::Cutting;
use super::predict::{Predicted, Way, exit_of, rays_of};
use super::scan::mean;
use super::{Photographs, predict};
use crate::backend::{Backend, Batch, Layers, Marching, Objective, RayGradient};
use crate::blur::gaussian_blur;
use crate::cancel::Cancelled;
use crate::events::{Observer, Task};
use crate::model::axis::Axis;
use crate::model::{Optics, Refraction};
use crate::random::Random;
use rayon::prelude::*;
use refraxel_core::index::MediumGradient;
use refraxel_core::optics::{PathAdjoint, RayAdjoint, Tracer};
use refraxel_core::radiance::Pixel;
use refraxel_core::segment::SegmentAdjoint;
use refraxel_core::structure::LUMINANCE;
use refraxel_core::{IndexGrid, LevelSet, Medium, Path, Ray, Vec3};
use std::time::Instant;

/// A stage: nodes along the longest edge of the grid of φ, the detail of pictures, steps.
const STAGES: [(u32, Detail, usize); 4] =
    [(20, Detail::Coarse, 30), (26, Detail::Middle, 30), (34, Detail::Middle, 30), (42, Detail::Fine, 20)];
/// Views of a step.
const VIEWS: usize = 8;
/// Largest step of a node [voxel], and of the index.
const RATE: f32 = 0.04;
const INDEX_RATE: f32 = 0.003;
/// At the end of a stage steps are smaller by this factor.
const LAST: f32 = 0.1;
/// Decay of the first and second moment of the gradient.
const DECAY: [f32; 2] = [0.8, 0.95];
/// The blur of the gradient of φ [node].
const BLUR: f32 = 1.5;
/// The weight of outlines in the score, for each square of a distance [voxel²], and the distance from which on they are taken for those
/// of something else [voxel].
const OUTLINE: f32 = 0.15;
const SOFT: f32 = 0.8;
/// Outlines of a step.
const OUTLINES: usize = 3000;
/// A path counts in the gradient where it meets two surfaces, both at cosines of at least this.
const LEAST_COSINE: f32 = 0.4;
/// Gradients of exit directions are cut at this multiple of their median.
const CUT: f32 = 6.0;

/// What a refinement works with.
pub(crate) struct Refiner<'a> {
    /// It bends nothing, and is clear where the bodies are.
    pub backend: &'a dyn Backend,
    pub marching: Marching,
    pub photographs: &'a Photographs,
    /// Rays that touch the body, as far as masks are right.
    pub outlines: &'a [Ray<f32>],
    /// The axis of a body of revolution, which it stays.
    pub axis: Option<Axis>,
    /// What else bends rays.
    pub others: &'a [IndexGrid<f32>],
    pub optics: Optics,
    /// Part of the usual steps that it may take, in (0, 1]: a short run waits for no long refinement.
    pub effort: f64,
    /// When it ends at the latest.
    pub until: Option<Instant>,
}

/// A gradient of the score.
struct Ascent {
    surface: Vec<f32>,
    index: f32,
}

/// First and second moments, theory (4.7).
struct Moments {
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Refiner<'_> {
    /// A surface and an index that score more; `None` where none was found.
    ///
    /// Each stage begins where the last one was better, and counts if it is better itself.
    pub(crate) fn refine(
        &self,
        surface: &LevelSet<f32>,
        index: f32,
        observer: &mut Observer,
    ) -> Result<Option<(LevelSet<f32>, f32)>, Cancelled> {
        let (mut best, mut is_better) = ((surface.clone(), index), false);
        let mut most = self.score(&best);
        let steps_of = |usual: usize| ((self.effort * usual as f64).ceil() as usize).max(1);
        let (total, mut done) = (STAGES.iter().map(|s| steps_of(s.2)).sum::<usize>() as u64, 0);
        for (nodes, detail, usual) in STAGES {
            let steps = steps_of(usual);
            let mut body = (resampled(&best.0, nodes), best.1);
            let mut of_surface = Moments::new(body.0.coefficients().len());
            let mut of_index = Moments::new(1);
            for k in 0..steps {
                observer.progress(Task::RefiningSurface, done, total)?;
                if self.until.is_some_and(|end| Instant::now() > end) {
                    return Ok(is_better.then_some(best));
                }
                self.step(&mut body, [&mut of_surface, &mut of_index], (detail, k, steps), done as usize);
                done += 1;
            }
            body.0.redistance();
            let score = self.score(&body);
            if score > most {
                (best, most, is_better) = (body, score, true);
            }
        }
        Ok(is_better.then_some(best))
    }

    /// How a body scores in all views, in pictures by which verdicts are taken.
    fn score(&self, (surface, index): &(LevelSet<f32>, f32)) -> f64 {
        let medium = self.medium(surface, *index);
        let predicted =
            predict(self.backend, &self.marching, self.photographs, Detail::Middle, &medium, Way::Bent);
        mean(&predicted.scores(self.photographs))
    }

    /// Step `k` of a stage of so many, and step number `number` of all.
    fn step(
        &self,
        (surface, index): &mut (LevelSet<f32>, f32),
        [of_surface, of_index]: [&mut Moments; 2],
        (detail, k, steps): (Detail, usize, usize),
        number: usize,
    ) {
        let random = Random::new(0);
        let chosen = drawn(self.photographs.views(), VIEWS, number, &random);
        let mut ascent = self.ascent(&self.medium(surface, *index), detail, &chosen);
        self.hold_outlines(surface, &mut ascent.surface, number, &random);
        gaussian_blur(&mut ascent.surface, surface.domain().resolution, BLUR);
        if let Some(axis) = self.axis {
            axis.average(surface, &mut ascent.surface);
        }
        let turn = std::f32::consts::PI * k as f32 / steps as f32;
        let slower = LAST + (1.0 - LAST) * 0.5 * (1.0 + turn.cos());
        let moves = of_surface.moved(&ascent.surface, k);
        let by = RATE * surface.voxel() * slower;
        let parameters: Vec<usize> = surface.parameters().collect();
        let coefficients = surface.coefficients_mut();
        parameters.iter().for_each(|j| coefficients[*j] += by * moves[*j]);
        surface.find_surface();
        *index = (*index + INDEX_RATE * slower * of_index.moved(&[ascent.index], k)[0]).max(1.0);
    }

    fn medium(&self, surface: &LevelSet<f32>, index: f32) -> Refraction {
        let body = IndexGrid::sharp(surface.clone(), index);
        let bodies = std::iter::once(body).chain(self.others.iter().cloned()).collect();
        let medium = Medium::new(bodies).unwrap_or_else(|e| unreachable!("bodies may overlap: {e}"));
        Refraction { medium, states: Vec::new(), optics: self.optics }
    }

    /// The gradient of the score of some views by the first body.
    fn ascent(&self, medium: &Refraction, detail: Detail, chosen: &[usize]) -> Ascent {
        let all = self.photographs.cuttings(detail);
        let cuttings: Vec<&Cutting> = chosen.iter().map(|k| &all[*k]).collect();
        let rays = rays_of(&cuttings);
        let tracer = medium.tracer(self.backend.domain(), 0.0);
        let paths: Vec<Path<f32>> = rays.par_iter().with_min_len(256).map(|r| tracer.trace(r)).collect();
        let exits: Vec<Option<Ray<f32>>> = paths.iter().zip(&rays).map(|(p, r)| exit_of(p, r)).collect();
        let marching = Marching { near: 0.0, ..self.marching };
        let asked: Vec<Ray<f32>> = exits.iter().flatten().copied().collect();
        let pixels = self.backend.render(&asked, &marching, Layers::All);
        let predicted = Predicted::of(detail, &cuttings, &exits, &pixels, self.backend.domain().extent);
        let d_rays = predicted.gradient(&cuttings);
        let usable: Vec<usize> =
            (0..rays.len()).filter(|&k| d_rays[k] != 0.0 && is_gentle(&paths[k], medium)).collect();
        let d_exits = self.exit_gradients(&exits, &pixels, &d_rays, &usable, &marching);
        let gradient = path_gradients(&tracer, medium, &rays, &paths, &usable, &d_exits);
        let n = medium.medium.regions()[0].interior_index().unwrap_or(1.0);
        let index = n * gradient.index[0].iter().sum::<f32>();
        Ascent { surface: gradient.level_set.into_iter().next().unwrap_or_default(), index }
    }

    /// dScore/d(exit ray) of the usable rays, by the adjoint of the field.
    fn exit_gradients(
        &self,
        exits: &[Option<Ray<f32>>],
        pixels: &[Pixel<f32>],
        d_rays: &[f32],
        usable: &[usize],
        marching: &Marching,
    ) -> Vec<RayAdjoint<f32>> {
        // A squared error whose derivative by the colour is that of the score, on a scale that f32 holds beside colours.
        let largest = usable.iter().map(|k| d_rays[*k].abs()).fold(0.0, f32::max);
        if largest == 0.0 {
            return Vec::new();
        }
        let scale = 0.2 / largest;
        let mut number = vec![usize::MAX; exits.len()];
        (0..exits.len()).filter(|k| exits[*k].is_some()).enumerate().for_each(|(j, k)| number[k] = j);
        let mut batch = Batch::default();
        for k in usable {
            let Some(exit) = exits[*k] else { continue };
            let d_luminance = d_rays[*k] * scale;
            batch.rays.push(exit);
            let colour = pixels[number[*k]].colour;
            batch.target.push([0, 1, 2].map(|c| colour[c] - 0.5 * d_luminance * LUMINANCE[c] as f32));
            batch.offset.push(0.5);
        }
        let found = self.backend.ray_gradients(&batch, &Objective::still(*marching));
        let along = |(g, ray): (&RayGradient, &Ray<f32>)| {
            let d = g.direction - ray.direction * ray.direction.dot(g.direction);
            RayAdjoint { origin: g.origin * scale.recip(), direction: d * scale.recip() }
        };
        let mut out: Vec<RayAdjoint<f32>> = found.iter().zip(&batch.rays).map(along).collect();
        cut(&mut out);
        out
    }

    /// Adds the gradient of −[`OUTLINE`] · mean r²/(1 + r²/SOFT²), r being the least φ along a ray that touches the body [voxel].
    fn hold_outlines(&self, surface: &LevelSet<f32>, grad: &mut [f32], step: usize, random: &Random) {
        if self.outlines.is_empty() {
            return;
        }
        let count = OUTLINES.min(self.outlines.len());
        let voxel = surface.voxel();
        let pick = |k: usize| {
            let which = random.below(self.outlines.len() as u64, step as u64, k as u64) as usize;
            let (x, phi) = lowest(surface, &self.outlines[which])?;
            let r = phi / voxel;
            let q = 1.0 + r * r / (SOFT * SOFT);
            (r.abs() < 4.0).then_some((x, -OUTLINE * 2.0 * r / (q * q) / voxel / count as f32))
        };
        let found: Vec<_> = (0..count).into_par_iter().filter_map(pick).collect();
        found.iter().for_each(|(x, d)| surface.scatter(*x, *d, Vec3::zero(), grad));
    }
}

/// The point of a ray where φ is least, and φ there.
fn lowest(surface: &LevelSet<f32>, ray: &Ray<f32>) -> Option<(Vec3<f32>, f32)> {
    let [from, to] = surface.domain().bounds.clip(ray)?;
    let step = 0.5 * surface.voxel();
    let mut best = (ray.at(from), f32::INFINITY);
    let mut t = from.max(0.0);
    while t < to {
        let x = ray.at(t);
        let phi = surface.value(x);
        if phi < best.1 {
            best = (x, phi);
        }
        t += step.max(0.6 * phi);
    }
    best.1.is_finite().then_some(best)
}

/// The same surface on a grid of so many nodes along the longest edge.
fn resampled(surface: &LevelSet<f32>, nodes: u32) -> LevelSet<f32> {
    let bounds = surface.domain().bounds;
    let voxel = bounds.extent().max_element() / (nodes - 1) as f32;
    let resolution = bounds.extent().to_array().map(|e| ((e / voxel).round() as u32 + 1).max(9));
    LevelSet::from_samples(bounds, resolution, |x| surface.value(x))
}

/// Some of so many, other ones in each step until all had their turn.
fn drawn(all: usize, count: usize, step: usize, random: &Random) -> Vec<usize> {
    let count = count.min(all);
    let rounds = all.div_ceil(count.max(1)).max(1);
    let (round, turn) = (step / rounds, step % rounds);
    let mut order: Vec<usize> = (0..all).collect();
    order.sort_by_key(|k| random.bits(round as u64, *k as u64));
    (0..count).map(|k| order[(turn * count + k) % all]).collect()
}

/// The path passes through the body once, and meets its surface at no small angle.
fn is_gentle(path: &Path<f32>, medium: &Refraction) -> bool {
    if path.events().count() != 2 {
        return false;
    }
    let pieces = path.steps.iter().zip(path.segments.windows(2));
    pieces.filter(|(step, _)| step.event.is_some()).all(|(step, segments)| {
        let level = medium.medium.regions()[usize::from(step.region)].level_set();
        level.is_some_and(|level| {
            let normal = level.sample(segments[1].start).1.normalized();
            segments.iter().all(|s| s.momentum.normalized().dot(normal).abs() > LEAST_COSINE)
        })
    })
}

/// Through paths back to the medium.
fn path_gradients(
    tracer: &Tracer<f32>,
    medium: &Refraction,
    rays: &[Ray<f32>],
    paths: &[Path<f32>],
    usable: &[usize],
    d_exits: &[RayAdjoint<f32>],
) -> MediumGradient<f32> {
    let zero = || (medium.medium.zero_gradient(), Vec::new());
    let add = |(mut grad, mut sums): (MediumGradient<f32>, Vec<SegmentAdjoint<f32>>),
               (k, d): (&usize, &RayAdjoint<f32>)| {
        let path = &paths[*k];
        sums.clear();
        sums.resize(path.segments.len(), SegmentAdjoint::default());
        if let Some(last) = sums.last_mut() {
            (last.start, last.momentum) = (d.origin, d.direction);
        }
        let exit = RayAdjoint::default();
        let d_path = PathAdjoint { segments: &sums, reflections: &[], exit };
        tracer.vjp(&rays[*k], path, &d_path, &mut grad);
        (grad, sums)
    };
    const PARTS: usize = 8;
    let size = usable.len().div_ceil(PARTS).max(1);
    let parts: Vec<MediumGradient<f32>> = usable
        .par_chunks(size)
        .zip(d_exits.par_chunks(size))
        .map(|(k, d)| k.iter().zip(d).fold(zero(), add).0)
        .collect();
    let mut total = medium.medium.zero_gradient();
    for part in &parts {
        let lists =
            total.index.iter_mut().zip(&part.index).chain(total.level_set.iter_mut().zip(&part.level_set));
        lists.for_each(|(to, from)| to.iter_mut().zip(from).for_each(|(t, f)| *t += *f));
    }
    total
}

/// Shortens those gradients that are far longer than the median: they come from edges of the field that no picture shows so sharp.
fn cut(gradients: &mut [RayAdjoint<f32>]) {
    let mut lengths: Vec<f32> = gradients.iter().map(|g| g.direction.length()).filter(|l| *l > 0.0).collect();
    let middle = lengths.len() / 2;
    if lengths.is_empty() {
        return;
    }
    let most = CUT * *lengths.select_nth_unstable_by(middle, f32::total_cmp).1;
    for g in gradients {
        let length = g.direction.length();
        if !length.is_finite() {
            *g = RayAdjoint::default();
        } else if length > most {
            (g.origin, g.direction) = (g.origin * (most / length), g.direction * (most / length));
        }
    }
}

impl Moments {
    fn new(count: usize) -> Self {
        Self { first: vec![0.0; count], second: vec![0.0; count] }
    }

    /// The next step, by Adam whose second moment is mostly that of all nodes which have a gradient: steps of a surface must vary
    /// smoothly.
    fn moved(&mut self, gradient: &[f32], step: usize) -> Vec<f32> {
        const SHARED: f32 = 0.7;
        let [a, b] = DECAY;
        for ((m, v), g) in self.first.iter_mut().zip(&mut self.second).zip(gradient) {
            *m = a * *m + (1.0 - a) * g;
            *v = b * *v + (1.0 - b) * g * g;
        }
        let corrections = [a, b].map(|d| 1.0 - d.powi(step as i32 + 1));
        let largest = self.second.iter().copied().fold(0.0, f32::max);
        let counted: Vec<f32> = self.second.iter().copied().filter(|v| *v > 1e-2 * largest).collect();
        let mean = counted.iter().sum::<f32>() / counted.len().max(1) as f32;
        let step_of = |(m, v): (&f32, &f32)| {
            let v = (1.0 - SHARED) * v + SHARED * mean;
            if v > 0.0 { m / corrections[0] / (v / corrections[1]).sqrt() } else { 0.0 }
        };
        self.first.iter().zip(&self.second).map(step_of).collect()
    }
}
