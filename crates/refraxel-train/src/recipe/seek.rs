//! Where refractive things are when no mask says so: where straight rays fail.
//!
//! Straight rays learn the scene first. What they show of a view and its photograph differ most where light was bent. A place
//! that most views see through such pixels belongs to something that straight rays cannot explain: the visual hull of the
//! residuals. Which residual is large, and how many views must agree, is what [separates](separation) the pixels of the hull
//! from those of everything else best. Where nothing refracts, no hull separates them.
//!
//! While the surroundings are known badly, haze explains a part of what is seen through glass. So there are several looks: after
//! each, what was found is cleared and straight rays learn what lies outside of it; the next look sees the photographs before
//! the scene without the thing.

mod evidence;
mod hints;
mod hull;
mod refine;
#[cfg(test)]
mod tests;

pub use hints::Hints;

use crate::backend::Backend;
use crate::cancel::Cancelled;
use crate::events::Watch;
use crate::model::Gate;
use crate::model::polyhedron::Plane;
use crate::rays::{RaySampler, cells, pixel_ray};
use crate::recipe::Known;
use crate::recipe::ground::Ground;
use crate::schedule::training_marching;
use evidence::{Evidence, cell_edge, coarse, look, outlines, silhouettes};
use hull::{Carved, bodies};
use rayon::prelude::*;
use refine::{Refining, Votes};
use refraxel_core::{Aabb, Camera};
use refraxel_data::Mask;

/// Residuals that count as large, tried one after the other: root mean square over the channels of sRGB code values.
const RESIDUALS: [f32; 5] = [0.03, 0.045, 0.07, 0.1, 0.15];
/// Shares of the views that must agree on a place.
const VOTES: [f32; 3] = [0.6, 0.75, 0.9];
/// Of hulls that separate to this part as well as the best, the largest is taken: what is taken for refractive without being so
/// costs little, haze instead of glass costs much.
const AS_GOOD: f64 = 0.8;
/// Views by which hulls are compared, at most.
const COMPARED: usize = 32;
/// Nodes along the longest edge of the first hulls.
const NODES: u32 = 52;
/// Nodes along the longest edge of the refined shape at most, and voxels per cell there.
const REFINED: (u32, f32) = (96, 1.2);
/// Mean votes that what is inside must have, tried one after the other: the shapes shrink.
const BOUNDS: [f32; 8] = [0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.85];
/// Of refined shapes that separate to this part as well as the best, the largest is taken, at the first look and later: haze at the
/// border of a thing must be cleared, too.
const NEARLY: [f64; 2] = [0.85, 0.98];

/// What a look saw.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    /// How well the best shape separates what is explained from what is not: [`Separation::share`].
    pub separation: f64,
    /// What straight rays cannot explain, if it separates well enough.
    pub sought: Option<Sought>,
}

impl Seen {
    const NOTHING: Self = Self { separation: 0.0, sought: None };
}

/// What straight rays cannot explain.
#[derive(Clone, Debug)]
pub(crate) struct Sought {
    /// Where it is.
    pub gate: Gate,
    /// What it stands on.
    pub ground: Option<Plane>,
}

/// Looks at all photographs, for the first time or once more: what was found before is refined by what is seen now. Nothing is
/// found where straight rays explain them, or where what they do not explain is nowhere in particular. With hints, something is there, however
/// little it stands out.
pub(crate) fn seek(
    backend: &impl Backend,
    known: &Known,
    hints: &Hints,
    before: Option<&Gate>,
    watch: &mut Watch,
) -> Result<Seen, Cancelled> {
    let (options, sampler) = (known.options, known.sampler);
    let marching = training_marching(options, known.near);
    let evidence = look(backend, sampler, options.seek.cells, &marching, watch)?;
    let bounds = options.refraction.aabb().unwrap_or(backend.domain().bounds);
    let first = match before {
        Some(gate) => Carved::of(gate, &bounds),
        None => best_hull(&evidence, &bounds, hints, watch)?,
    };
    let Some(first) = first else { return Ok(Seen::NOTHING) };
    let cell = sampler.pixel_size(first.bounds.center()) * cell_edge(sampler, options.seek.cells) as f32;
    let nodes = REFINED.1 * first.bounds.extent().max_element() / cell;
    let nodes = (nodes.round() as u32).clamp(NODES / 2, REFINED.0);
    let ground = Ground::new(&silhouettes(&evidence, RESIDUALS[0]), backend.domain().voxel());
    let ground = ground.under(&first.surface());
    let clean = before.is_some();
    let votes = Votes::new(&first, &evidence, Refining { nodes, clean, ground }, hints, watch.cancel());
    let all: Vec<&Evidence> = evidence.iter().collect();
    let mut tried: Vec<(Separation, Gate)> = Vec::new();
    for bound in BOUNDS {
        watch.cancel().check()?;
        let gate = votes.shape(bound, hints);
        tried.push((separation(&all, &gate), gate));
    }
    let most = tried.iter().map(|t| t.0.share).fold(0.0, f64::max);
    let enough = NEARLY[usize::from(clean)] * most;
    let best = tried.into_iter().find(|t| t.0.share >= enough);
    let Some((Separation { share: separation, .. }, gate)) = best else { return Ok(Seen::NOTHING) };
    let needed = if hints.is_empty() { options.seek.separation } else { 0.0 };
    let is_found = separation > 0.0 && separation >= needed;
    Ok(Seen { separation, sought: is_found.then_some(Sought { gate, ground }) })
}

/// The hull to begin with.
fn best_hull(
    evidence: &[Evidence],
    bounds: &Aabb<f32>,
    hints: &Hints,
    watch: &mut Watch,
) -> Result<Option<Carved>, Cancelled> {
    let few: Vec<&Evidence> = evidence.iter().step_by(evidence.len().div_ceil(COMPARED).max(1)).collect();
    let mut tried: Vec<(Separation, Carved)> = Vec::new();
    for residual in RESIDUALS {
        let outlines = outlines(evidence, residual).cancelled_by(watch.cancel());
        for vote in VOTES {
            watch.cancel().check()?;
            if let Some(found) = bodies(&outlines, bounds, vote, NODES, hints) {
                tried.push((separation(&few, &found.gate), found));
            }
        }
    }
    let most = tried.iter().map(|t| t.0.share).fold(0.0, f64::max);
    let good = tried.into_iter().filter(|t| t.0.share >= AS_GOOD * most && t.0.share > 0.0);
    Ok(good.max_by(|a, b| a.0.covered.total_cmp(&b.0.covered)).map(|(_, found)| found))
}

/// How well a hull separates what straight rays explain from what they do not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Separation {
    /// Share of the variance of the residuals that the hull explains, 0 to 1: p (1 − p) (r₁ − r₀)² / variance, with the share p
    /// and the mean residual r₁ of the cells that it covers, and the mean r₀ of the others. (Otsu's criterion.)
    pub share: f64,
    /// p.
    pub covered: f64,
}

/// Number, sum and sum of squares of the residuals of cells beside what a gate covers, and of cells that it covers: of those that
/// show something, for what is empty is explained by anything.
fn moments(views: &[&Evidence], gate: &Gate) -> [[f64; 3]; 2] {
    let of = |view: &&Evidence| {
        let mut sums = [[0.0_f64; 3]; 2];
        for (cell, residual) in view.residual.iter().enumerate().filter(|(cell, _)| view.counts(*cell)) {
            let covered = view.rays[cell].is_some_and(|ray| gate.admits(&ray));
            if covered || view.shows_something(cell) {
                let r = f64::from(*residual);
                (0..3).for_each(|k| sums[usize::from(covered)][k] += r.powi(k as i32));
            }
        }
        sums
    };
    let add =
        |a: [[f64; 3]; 2], b: [[f64; 3]; 2]| [0, 1].map(|s| [0, 1, 2].map(|k: usize| a[s][k] + b[s][k]));
    let per_view: Vec<[[f64; 3]; 2]> = views.par_iter().map(of).collect();
    per_view.into_iter().fold([[0.0; 3]; 2], add)
}

/// The separation by a gate.
fn separation(views: &[&Evidence], gate: &Gate) -> Separation {
    let [out, inside] = moments(views, gate);
    let all: [f64; 3] = [0, 1, 2].map(|k| out[k] + inside[k]);
    if out[0] == 0.0 || inside[0] == 0.0 {
        return Separation::default();
    }
    let covered = inside[0] / all[0];
    let variance = all[2] / all[0] - (all[1] / all[0]).powi(2);
    let (within, beside) = (inside[1] / inside[0], out[1] / out[0]);
    // Where less is unexplained inside than outside, nothing is found.
    let step = (within - beside).max(0.0);
    let share = if variance > 0.0 { covered * (1.0 - covered) * step * step / variance } else { 0.0 };
    Separation { share, covered }
}

/// Rays that project what was found into a view, about.
const PROJECTED: f64 = 1e5;

/// What was found, as masks of the views that have none.
pub(crate) fn masks(found: &[Gate], sampler: &RaySampler) -> Vec<Option<Mask>> {
    let project = |camera: &Camera| {
        let pixels = f64::from(camera.width) * f64::from(camera.height);
        mask(found, camera, (pixels / PROJECTED).sqrt().max(1.0))
    };
    sampler.pictures().map(|picture| picture.mask().is_none().then(|| project(picture.camera))).collect()
}

/// The mask of what was found in a view, in squares of `edge` pixels. What stands before it is not left out.
pub fn mask(found: &[Gate], camera: &Camera, edge: f64) -> Mask {
    let (width, height) = (camera.width, camera.height);
    let coarse = coarse(camera, edge);
    let (across, down) = (coarse.width as usize, coarse.height as usize);
    let covers =
        |cell: usize| pixel_ray(&coarse, cell).is_some_and(|ray| found.iter().any(|gate| gate.admits(&ray)));
    let covered: Vec<u8> =
        (0..across * down).into_par_iter().map(|c| if covers(c) { 255 } else { 0 }).collect();
    let coverage = cells([width as usize, height as usize], [across, down]).map(|(cell, _)| covered[cell]);
    Mask { width, height, coverage: coverage.collect() }
}
